//! What the numbers of a blackbox log measure: units by the header and by the firmware that wrote it.

use super::header::FlightHeader;
use crate::log::thresholds::THRESHOLDS;

/// `(number - zero) * factor / divisor` in `unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    zero: f64,
    factor: f64,
    divisor: f64,
    /// Unit of what comes out; `None` where nobody says.
    pub(super) unit: Option<&'static str>,
}

impl Scale {
    /// As the file has it.
    pub(super) const RAW: Self = Self { zero: 0.0, factor: 1.0, divisor: 1.0, unit: None };

    const fn of(factor: f64, divisor: f64, unit: &'static str) -> Self {
        Self { zero: 0.0, factor, divisor, unit: Some(unit) }
    }

    /// The value of a number.
    pub(super) fn value(&self, number: f64) -> f64 {
        (number - self.zero) * self.factor / self.divisor
    }
}

/// Name and version of the firmware, as in `Betaflight 4.5.1 (77d01ba3b) STM32H743`.
fn firmware(header: &FlightHeader) -> (&str, f64) {
    let mut words = header.text("Firmware revision").unwrap_or_default().split_whitespace();
    let name = words.next().unwrap_or_default();
    let mut version = words.next().unwrap_or_default().split(['.', '-']);
    let mut part = || version.next().and_then(|text| text.parse::<f64>().ok());
    let major = part().unwrap_or(0.0);
    (name, major + part().unwrap_or(0.0) / 1_000.0)
}

/// How a field of a main frame is scaled; `None` where that takes a line of the header that is not there.
pub(super) fn of_field(header: &FlightHeader, name: &str) -> Option<Scale> {
    // With high resolution the rates and commands carry one more decimal.
    let fine = if header.number("blackbox_high_resolution", 0) == Some(1.0) { 10.0 } else { 1.0 };
    let (stem, index) = name.split_once('[').unwrap_or((name, ""));
    match stem {
        "motor" => motor(header),
        // The firmware writes hundreds of electrical turns a minute; a pair of poles is one turn in `poles / 2`.
        "eRPM" => {
            let poles = header.number("motor_poles", 0).filter(|poles| *poles >= 2.0)?;
            Some(Scale::of(200.0, poles, "rpm"))
        }
        "gyroADC" | "gyroUnfilt" | "gyroRaw" | "gyroRaw2" => {
            let scale = header.bits("gyro.scale").filter(|it| *it > 0.0)?;
            // Baseflight wrote radians in a microsecond, about 1e-9; all others write degrees in a second, 0.01 to 1.
            let factor = if scale < 1e-5 { (1e6 * scale).to_degrees() } else { scale };
            Some(Scale::of(factor, fine, "deg/s"))
        }
        "accSmooth" => {
            let gravity = header.number("acc_1G", 0).filter(|it| *it > 0.0)?;
            Some(Scale::of(1.0, gravity * fine, "g"))
        }
        "setpoint" if !index.starts_with('3') => Some(Scale::of(1.0, fine, "deg/s")),
        "attitude" => Some(Scale::of(1.0, 10.0, "deg")),
        "baroAlt" | "BaroAlt" => Some(Scale::of(1.0, 1.0, "cm")),
        "vbatLatest" => battery_voltage(header),
        "amperageLatest" => battery_current(header),
        _ => Some(Scale::RAW),
    }
}

/// The command to an ESC, 0 to 1: `DShot` throttle is 48 to 2047 and pulses are 1000 to 2000 µs. The lowest output that the
/// header gives, idle, tells the two apart.
fn motor(header: &FlightHeader) -> Option<Scale> {
    let idle = header.number("motorOutput", 0).or_else(|| header.number("minthrottle", 0))?;
    let (zero, divisor) = if idle < THRESHOLDS.dshot_idle { (48.0, 1_999.0) } else { (1_000.0, 1_000.0) };
    Some(Scale { zero, factor: 1.0, divisor, unit: Some("-") })
}

fn battery_voltage(header: &FlightHeader) -> Option<Scale> {
    let hundredths = Scale::of(1.0, 100.0, "V");
    let tenths = Scale::of(1.0, 10.0, "V");
    match firmware(header) {
        ("Betaflight", version) if version >= 4.0 => Some(hundredths),
        ("Betaflight", version) if version >= 3.001 => Some(tenths),
        ("Cleanflight", version) if version >= 2.0 => Some(tenths),
        ("INAV", version) if version >= 2.0 => Some(hundredths),
        // A firmware that states its highest voltage of a cell as 420 counts hundredths of a volt.
        _ if header.number("vbatcellvoltage", 2).is_some_and(|cell| cell > 100.0) => Some(hundredths),
        // Readings of the converter of 12 bits and 3.3 V, behind a divider of `vbat_scale` tenths.
        (_, version) if version < 3.001 => {
            let scale = header.number("vbat_scale", 0).or_else(|| header.number("vbatscale", 0))?;
            Some(Scale::of(0.33 * scale, 4_095.0, "V"))
        }
        _ => None,
    }
}

fn battery_current(header: &FlightHeader) -> Option<Scale> {
    let hundredths = Scale::of(1.0, 100.0, "A");
    match firmware(header) {
        ("Betaflight", version) if version >= 3.001 => Some(hundredths),
        ("Cleanflight", version) if version >= 2.0 => Some(hundredths),
        ("INAV", version) if version >= 2.0 => Some(hundredths),
        // Readings of the converter; the sensor has its offset in mV and its slope in tenths of a mV to the ampere.
        (_, version) if version < 3.001 => {
            let setting = |place| {
                header.number("currentMeter", place).or_else(|| header.number("currentSensor", place))
            };
            let (offset, slope) = (setting(0)?, setting(1).filter(|slope| *slope != 0.0)?);
            let zero = offset * 4_095.0 / 3_300.0;
            Some(Scale { zero, factor: 33_000.0, divisor: 4_095.0 * slope, unit: Some("A") })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(lines: &str) -> FlightHeader {
        let fields = "H Field I name:time\nH Field I predictor:0\nH Field I encoding:1\n";
        FlightHeader::parse(format!("H Product:Blackbox\n{lines}{fields}").as_bytes()).expect("good")
    }

    fn value(lines: &str, field: &str, number: f64) -> Option<(f64, Option<&'static str>)> {
        of_field(&header(lines), field).map(|scale| (scale.value(number), scale.unit))
    }

    #[test]
    fn commands_are_of_dshot_or_of_pulses() {
        let dshot = "H motorOutput:158,2047\n";
        assert_eq!(value(dshot, "motor[0]", 48.0), Some((0.0, Some("-"))));
        assert_eq!(value(dshot, "motor[3]", 2_047.0), Some((1.0, Some("-"))));
        let pulses = "H motorOutput:1070,2000\n";
        assert_eq!(value(pulses, "motor[0]", 1_250.0), Some((0.25, Some("-"))));
        assert_eq!(value("H minthrottle:1150\n", "motor[0]", 1_250.0), Some((0.25, Some("-"))));
        assert_eq!(value("", "motor[0]", 1_250.0), None);
    }

    #[test]
    fn rates_are_mechanical() {
        // 14 poles: 100 hundreds of electrical turns are 10000/7 turns of the shaft.
        assert_eq!(value("H motor_poles:14\n", "eRPM[0]", 100.0), Some((20_000.0 / 14.0, Some("rpm"))));
        assert_eq!(value("H motor_poles:0\n", "eRPM[0]", 100.0), None);
    }

    #[test]
    fn a_firmware_s_version_decides_what_its_volts_are() {
        for (firmware, number, volts) in [
            ("Betaflight 4.5.1 (77d01ba3b) STM32H743", 1_612.0, Some(16.12)),
            ("Betaflight 2025.12.0-beta (abc) STM32F7X2", 1_612.0, Some(16.12)),
            ("Betaflight 3.5.7 (abc) BETAFLIGHTF3", 161.0, Some(16.1)),
            ("INAV 7.1.0 (abc) MATEKF405", 1_612.0, Some(16.12)),
            ("NewFlight 12.1 (abc)", 1_612.0, None),
        ] {
            let found = value(&format!("H Firmware revision:{firmware}\n"), "vbatLatest", number);
            assert_eq!(found.map(|it| it.0), volts, "{firmware}");
        }
        let fork = "H Firmware revision:NewFlight 12.1\nH vbatcellvoltage:330,350,430\n";
        assert_eq!(value(fork, "vbatLatest", 1_612.0), Some((16.12, Some("V"))));
        let (volts, _) =
            value("H Firmware revision:c49bd40\nH vbatscale:110\n", "vbatLatest", 1_819.0).expect("known");
        assert!((volts - 36.3 * 1_819.0 / 4_095.0).abs() < 1e-12, "{volts}");
        let (amperes, _) = value("H currentMeter:-5,400\n", "amperageLatest", 500.0).expect("known");
        let millivolts = 500.0 * 3_300.0 / 4_095.0 + 5.0;
        assert!((amperes - millivolts / 40.0).abs() < 1e-12, "{amperes}");
    }

    #[test]
    fn gyroscopes_of_all_ages() {
        let one = format!("H gyro_scale:0x{:x}\n", 1.0_f32.to_bits());
        assert_eq!(value(&one, "gyroADC[1]", -90.0), Some((-90.0, Some("deg/s"))));
        let fine = format!("{one}H blackbox_high_resolution:1\n");
        assert_eq!(value(&fine, "gyroUnfilt[1]", -905.0), Some((-90.5, Some("deg/s"))));
        assert_eq!(value(&fine, "setpoint[0]", 905.0), Some((90.5, Some("deg/s"))));
        assert_eq!(value(&fine, "setpoint[3]", 905.0), Some((905.0, None)));
        let old = format!("H gyro.scale:{:x}\n", 1e-9_f32.to_bits());
        let (rate, unit) = value(&old, "gyroADC[0]", 1_000.0).expect("known");
        // The number in the header has 32 bits.
        assert!((rate.to_radians() - 1.0).abs() < 1e-6 && unit == Some("deg/s"), "{rate}");
        assert_eq!(value("", "gyroADC[0]", 1.0), None);
    }
}
