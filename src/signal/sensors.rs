//! Everything measured: what the table in [`super::channels`] makes of it.

use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

use super::channels::After::{Hold, Never, Seconds};
// Whatever the rows are written with.
use super::channels::*;
use super::sample::NeverCame;
use super::{ROTORS, Sample};

macro_rules! define {
    ($(
        $(#[$doc:meta])*
        $field:ident: $type:ty as $sensor:ident, $unit:literal $suffix:literal,
        [$($channel:ident $name:literal $meaning:literal $([$index:literal])?),+ $(,)?],
        guard($($watched:ident = $guard:expr)?),
        $row:expr;
    )+) => {
        /// A sensor: a row of the table.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Sensor {
            $($(#[$doc])* $sensor,)+
        }

        /// One value of a sensor, and the role that a signal of the bus plays for it.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Channel {
            $($(
                #[doc = concat!("[", $unit, "] ", $meaning, ".")]
                #[serde(rename = $name)]
                $channel,
            )+)+
        }

        /// Everything measured, as the bridge or the emulator publishes it: the newest value of each channel.
        ///
        /// In a controller: `examples/own_controller.rs`.
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
        #[type_name("rotorbench::Sensors")]
        pub struct Sensors {
            /// Counts publications from 1; 0 = nothing published yet.
            pub sequence: u64,
            /// [ns] CLOCK_MONOTONIC at publication.
            pub stamp_ns: u64,
            $($(#[$doc])* pub $field: $type,)+
        }

        impl Default for Sensors {
            fn default() -> Self {
                Self { sequence: 0, stamp_ns: 0, $($field: <$type as NeverCame>::NEVER,)+ }
            }
        }

        /// Number of sensors.
        const SENSORS: usize = [$(Sensor::$sensor),+].len();
        /// Number of channels.
        const CHANNELS: usize = [$($(Channel::$channel),+),+].len();

        impl Sensor {
            /// All of them, in the order of the table.
            pub const ALL: [Self; SENSORS] = [$(Self::$sensor),+];

            /// As files spell it.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$sensor => stringify!($field),)+
                }
            }

            /// As files spell it, unit included: what its columns in a log have in common.
            #[must_use]
            pub const fn name_with_unit(self) -> &'static str {
                match self {
                    $(Self::$sensor => concat!(stringify!($field), $suffix),)+
                }
            }

            /// The end of its columns' names, which says the unit.
            #[must_use]
            pub const fn suffix(self) -> &'static str {
                match self {
                    $(Self::$sensor => $suffix,)+
                }
            }

            /// Its column in a log for any rotor, of a sensor on each: [`super::columns::ANY_ROTOR`] stands for the number.
            #[must_use]
            pub const fn column_of_any_rotor(self) -> &'static str {
                match self {
                    $(Self::$sensor => concat!(stringify!($field), "_*", $suffix),)+
                }
            }

            /// SI unit, as [`crate::unit::Unit::si`] spells it.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self {
                    $(Self::$sensor => $unit,)+
                }
            }

            /// Its values.
            #[must_use]
            pub const fn channels(self) -> &'static [Channel] {
                match self {
                    $(Self::$sensor => &[$(Channel::$channel),+],)+
                }
            }

            /// The guard's defaults; `None` = the guard does not watch it.
            #[must_use]
            pub const fn guard(self) -> Option<GuardRow> {
                match self {
                    $(Self::$sensor => [$(Some($guard),)? None][0],)+
                }
            }

            /// What else the table says of it.
            #[must_use]
            pub const fn row(self) -> SensorRow {
                match self {
                    $(Self::$sensor => $row,)+
                }
            }
        }

        impl Channel {
            /// All of them, in the order of the table.
            pub const ALL: [Self; CHANNELS] = [$($(Self::$channel),+),+];

            /// As files spell it.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $($(Self::$channel => $name,)+)+
                }
            }

            /// Its column in a log, unit included.
            #[must_use]
            pub const fn column(self) -> &'static str {
                match self {
                    $($(Self::$channel => concat!($name, $suffix),)+)+
                }
            }

            /// What it is, in a few words.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    $($(Self::$channel => $meaning,)+)+
                }
            }

            /// The sensor that gives it.
            #[must_use]
            pub const fn sensor(self) -> Sensor {
                match self {
                    $($(Self::$channel => Sensor::$sensor,)+)+
                }
            }

            /// Its newest sample.
            #[must_use]
            #[inline]
            pub const fn of(self, sensors: &Sensors) -> &Sample {
                match self {
                    $($(Self::$channel => &sensors.$field$([$index])?,)+)+
                }
            }

            /// Its newest sample, to write.
            #[must_use]
            #[inline]
            pub const fn of_mut(self, sensors: &mut Sensors) -> &mut Sample {
                match self {
                    $($(Self::$channel => &mut sensors.$field$([$index])?,)+)+
                }
            }
        }
    };
}
sensor_table!(define);

impl Channel {
    /// In the order of a log's columns.
    pub const IN_LOG: [Self; CHANNELS] = in_log();

    /// Those of them that the log format knows.
    pub const LOG_SIGNALS: [Self; count(Chosen::LogSignals)] = choose(Chosen::LogSignals);

    /// Those that the guard can watch; the place of each is its code, the subject of a [`super::GuardEvent`].
    pub const WATCHED: [Self; count(Chosen::Watched)] = choose(Chosen::Watched);

    /// SI unit, as [`crate::unit::Unit::si`] spells it.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        self.sensor().unit()
    }

    /// The bit of this channel in [`crate::can::Decoded::updated`].
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }

    /// Its code as the subject of a [`super::GuardEvent`]; `u32::MAX` = the guard does not watch it.
    #[must_use]
    pub fn subject(self) -> u32 {
        let place = Self::WATCHED.iter().position(|channel| *channel == self);
        place.and_then(|place| u32::try_from(place).ok()).unwrap_or(u32::MAX)
    }

    /// The channel with this code.
    #[must_use]
    pub fn of_subject(code: u32) -> Option<Self> {
        Self::WATCHED.get(usize::try_from(code).ok()?).copied()
    }

    /// The rotor it belongs to, from 0.
    #[must_use]
    pub fn rotor(self) -> Option<usize> {
        let sensor = self.sensor();
        let place = sensor.channels().iter().position(|channel| *channel == self);
        place.filter(|_| sensor.row().multiplicity == Multiplicity::Rotors)
    }

    /// For people: the sensor, and the rotor it belongs to.
    #[must_use]
    pub fn label(self) -> String {
        match self.rotor() {
            Some(rotor) => format!("{} {}", self.sensor().name(), rotor + 1),
            None => self.name().to_owned(),
        }
    }
}

impl std::fmt::Display for Channel {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name())
    }
}

// Each has a bit of its own.
const _: () = assert!(CHANNELS <= u32::BITS as usize);

/// Channels by a property of their sensor.
#[derive(Clone, Copy)]
enum Chosen {
    LogSignals,
    Watched,
}

/// Where each kind is looked for: in the order of a log, or of the table.
const fn list(chosen: Chosen) -> [Channel; CHANNELS] {
    match chosen {
        Chosen::LogSignals => Channel::IN_LOG,
        Chosen::Watched => Channel::ALL,
    }
}

const fn is_chosen(channel: Channel, chosen: Chosen) -> bool {
    match chosen {
        Chosen::LogSignals => channel.sensor().row().is_log_signal,
        Chosen::Watched => channel.sensor().guard().is_some(),
    }
}

const fn count(chosen: Chosen) -> usize {
    let (mut count, mut place) = (0, 0);
    while place < CHANNELS {
        count += is_chosen(list(chosen)[place], chosen) as usize;
        place += 1;
    }
    count
}

const fn choose<const N: usize>(chosen: Chosen) -> [Channel; N] {
    let list = list(chosen);
    let mut found = [list[0]; N];
    let (mut count, mut place) = (0, 0);
    while place < CHANNELS {
        if is_chosen(list[place], chosen) {
            found[count] = list[place];
            count += 1;
        }
        place += 1;
    }
    found
}

/// All channels by their place in a log; insertion keeps the order of equals.
const fn in_log() -> [Channel; CHANNELS] {
    let mut order = Channel::ALL;
    let mut sorted = 1;
    while sorted < CHANNELS {
        let mut place = sorted;
        while place > 0 && order[place - 1].sensor().row().log_place > order[place].sensor().row().log_place {
            (order[place - 1], order[place]) = (order[place], order[place - 1]);
            place -= 1;
        }
        sorted += 1;
    }
    order
}
