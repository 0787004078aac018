use crate::can::MessageConfig;
use crate::can::resolve::*;
use crate::can::route::FrameReading;

fn database(body: &str) -> Database {
    let text = format!("VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\n{body}\n");
    Database::parse("x.dbc", text.as_bytes()).expect("DBC")
}

/// The only signal of a message, bound to something measured in `si`.
fn bound(signal: &str, role: &SignalConfig, si: &'static str) -> Result<Binding<()>, String> {
    let database = database(&format!("BO_ 1 M: 8 A\n SG_ s : {signal} A"));
    let message = &database.messages[0];
    bind((), message, &message.signals[0], role, si)
}

fn role() -> SignalConfig {
    SignalConfig::new("M.s")
}

/// A unit with an offset, and a role's factor on it.
#[test]
fn a_signal_is_measured_in_the_units_of_the_house() {
    let signal = "0|8@1+ (0.5,-40) [-40|80] \"degC\"";
    let kelvin = bound(signal, &role(), "K").expect("a temperature");
    let near = |one: f64, other: f64| (one - other).abs() < 1e-9;
    assert!(near(kelvin.range.0, 233.15) && near(kelvin.range.1, 353.15), "{:?}", kelvin.range);
    let mut payload = [0; 64];
    payload[0] = 200;
    let Some(FrameReading::Value(value)) = kelvin.read(&payload) else { panic!("it is in range") };
    assert!(near(value, 333.15), "60 degrees: {value}");
    let twice = bound(signal, &SignalConfig { factor: -2.0, ..role() }, "K").expect("a temperature");
    assert!(near(twice.scale, -2.0) && near(twice.offset, -546.3), "{twice:?}");
    assert!(near(twice.range.0, -706.3) && near(twice.range.1, -466.3), "{:?}", twice.range);
    // Neither the file nor the role names limits: those of the bits.
    let bits = bound("0|8@1- (0.5,1) [0|0] \"V\"", &role(), "V").expect("a voltage");
    assert_eq!(bits.range, (-63.0, 64.5));
    let limits = SignalConfig { minimum: Some(-1.0), maximum: Some(2.0), ..role() };
    assert_eq!(
        bound(signal, &SignalConfig { unit: Some("V".to_owned()), ..limits }, "V").map(|it| it.range),
        Ok((-1.0, 2.0))
    );
}

/// 2,999,006 steps of 0.1 are a little more than 299,900.6.
#[test]
fn a_limit_on_the_grid_is_not_missed_by_rounding() {
    let limit = 299_900.6;
    let signal = format!("0|32@1- (0.1,0) [-{limit}|{limit}] \"V\"");
    let voltage = bound(&signal, &role(), "V").expect("a voltage");
    let read = |raw: i32| {
        let mut payload = [0; 64];
        payload[..4].copy_from_slice(&raw.to_le_bytes());
        voltage.read(&payload)
    };
    for sign in [1, -1] {
        let value = f64::from(sign * 2_999_006) * 0.1;
        assert_eq!(read(sign * 2_999_006), Some(FrameReading::Value(value)), "{value}");
        assert!(matches!(read(sign * 2_999_007), Some(FrameReading::Refused(_))));
    }
}

#[test]
fn a_role_without_a_value_between_its_limits_or_with_no_factor_is_refused() {
    let signal = "0|8@1+ (1,0) [0|100] \"V\"";
    let refused = |minimum, maximum| {
        bound(signal, &SignalConfig { minimum, maximum, ..role() }, "V")
            .is_err_and(|said| said.contains("no value lies"))
    };
    assert!(!refused(None, None) && !refused(Some(99.0), None) && !refused(None, Some(1.0)));
    assert!(refused(Some(100.0), None) && refused(None, Some(0.0)) && refused(Some(5.0), Some(4.0)));
    assert!(refused(Some(f64::NAN), None) && refused(None, Some(f64::NAN)));
    for factor in [0.0, f64::NAN, f64::INFINITY] {
        let said = bound(signal, &SignalConfig { factor, ..role() }, "V").expect_err("no factor");
        assert!(said.contains("cannot carry a value"), "{said}");
    }
}

#[test]
fn electrical_revolutions_are_divided_by_the_pole_pairs() {
    let unit = |name, pole_pairs| read_unit(name, pole_pairs, "rad/s").map(|unit| unit.scale);
    let rpm = unit("rpm", None).expect("a speed");
    assert_eq!((unit("ERPM", Some(7)), unit(" erpm ", Some(1))), (Ok(rpm / 7.0), Ok(rpm)));
    for (name, pole_pairs) in [("ERPM", None), ("ERPM", Some(0)), ("rpm", Some(7)), ("V", None)] {
        assert!(unit(name, pole_pairs).is_err(), "{name} {pole_pairs:?}");
    }
}

#[test]
fn a_node_stands_in_the_bits_of_its_mask_and_nowhere_else() {
    let odrive = Id::Standard(0x7E9);
    assert_eq!(substitute(odrive, None, Some(0x7E0)), Ok(odrive));
    assert_eq!(substitute(odrive, Some(3), Some(0x7E0)), Ok(Id::Standard(0x069)));
    assert_eq!(substitute(odrive, Some(0x3F), Some(0x7E0)), Ok(odrive));
    assert_eq!(substitute(Id::Extended(0x9_FF), Some(23), Some(0xFF)), Ok(Id::Extended(0x917)));
    let refused = |node, mask| substitute(odrive, Some(node), mask).expect_err("no such node");
    assert_eq!(refused(0x40, Some(0x7E0)), "node 64 does not fit the node_mask 0x7E0");
    assert_eq!(refused(0xFFFF, Some(0xFFFF)), "the node_mask 0xFFFF does not fit the identifier 7E9");
    assert_eq!((refused(1, None), refused(1, Some(0))), (refused(0, None), refused(0, Some(0))));
}

#[test]
fn a_counter_is_a_plain_unsigned_integer_of_every_frame() {
    let database = database(
        "BO_ 1 M: 8 A\n SG_ page M : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ paged m1 : 8|8@1+ (1,0) [0|0] \"\" A\n \
         SG_ plain : 16|8@1+ (1,0) [0|0] \"\" A\n SG_ twice : 24|8@1+ (2,0) [0|0] \"\" A\n \
         SG_ from_one : 32|8@1+ (1,1) [0|0] \"\" A\n SG_ signed : 40|8@1- (1,0) [0|0] \"\" A",
    );
    let said = |name| {
        find_counter(&database.messages[0], name).map(|(name, _)| name).map_err(|error| error.to_string())
    };
    assert_eq!(said("plain"), Ok("plain".to_owned()));
    for name in ["paged", "twice", "from_one", "signed"] {
        assert_eq!(
            said(name),
            Err(format!("bus.messages.M.counter: `{name}` must be a plain unsigned integer"))
        );
    }
    assert_eq!(said("none"), Err("bus.messages.M.counter: message `M` has no signal `none`".to_owned()));
}

#[test]
fn every_multiplexer_above_a_signal_selects_it() {
    let database = database(
        "BO_ 1 M: 8 A\n SG_ a M : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ b m1M : 8|8@1+ (1,0) [0|0] \"\" A\n \
         SG_ c m2 : 16|8@1+ (1,0) [0|0] \"\" A\n\nSG_MUL_VAL_ 1 b a 1-1;\nSG_MUL_VAL_ 1 c b 2-2, 5-6;",
    );
    let message = &database.messages[0];
    let above = |name| {
        let found = selectors(message, message.signal(name).expect("there"));
        found.into_iter().map(|(codec, values)| (codec.layout().start, values)).collect::<Vec<_>>()
    };
    assert_eq!(above("a"), []);
    assert_eq!(above("b"), [(0, vec![(1, 1)])]);
    assert_eq!(above("c"), [(8, vec![(2, 2), (5, 6)]), (0, vec![(1, 1)])]);
}

#[test]
fn a_list_of_names_ends_somewhere() {
    let names: Vec<String> = (1..=14).map(|number| number.to_string()).collect();
    assert_eq!(list(names[..2].iter()), "`1`, `2`");
    assert!(list(names[..12].iter()).ends_with("`11`, `12`"));
    assert!(list(names.iter()).ends_with("`11`, `12` and 2 more"));
}

/// A bench of one sensor and one command message.
fn table(sensors: &[(Channel, &str)]) -> BusConfig {
    let commands = [(CommandField::Rotor1, "C.one"), (CommandField::Rotor2, "C.two")];
    BusConfig {
        sensors: sensors.iter().map(|(field, signal)| (*field, SignalConfig::new(signal))).collect(),
        commands: commands.map(|(field, signal)| (field, SignalConfig::new(signal))).into(),
        messages: [].into(),
        ..BusConfig::default()
    }
}

const COMMANDS: &str = "BO_ 1 C: 8 A\n SG_ one : 0|16@1+ (0.001,0) [0|0] \"\" A\n SG_ two : 16|16@1+ (0.001,0) [0|0] \"\" A\n \
     SG_ back : 32|16@1+ (1,0) [0|0] \"V\" A\n\n";
const WIDE: &str = "BO_ 2 W: 64 A\n SG_ volt : 496|8@1+ (1,0) [0|0] \"V\" A\n\nBO_ 3 ODD: 9 A\n SG_ volt : 64|8@1+ (1,0) [0|0] \"V\" A\n";

fn built(config: &BusConfig, databases: &[Database], period_s: f64) -> Result<Roles, String> {
    Roles::resolve(config, databases, period_s).map_err(|error| error.to_string())
}

#[test]
fn a_bus_may_be_full_to_the_last_bit() {
    let databases = [database(COMMANDS)];
    let config = BusConfig { bit_rate: 135_000, ..table(&[]) };
    assert!(built(&config, &databases, 0.001).is_ok(), "135 bits a millisecond");
    let config = BusConfig { bit_rate: 134_999, ..config };
    assert!(built(&config, &databases, 0.001).is_err_and(|said| said.contains("100.0 % loaded")));
}

#[test]
fn more_than_eight_bytes_need_fd_and_a_length_that_it_has() {
    let databases = [database(&format!("{COMMANDS}{WIDE}"))];
    let classic = table(&[(Channel::BatteryVoltage, "W.volt")]);
    let said = |config: &BusConfig| built(config, &databases, 0.01).map(drop);
    let place = "bus.sensors.battery_voltage";
    assert_eq!(said(&classic), Err(format!("{place}: `W` has 64 bytes, which needs bus.fd = true")));
    let fd = BusConfig { fd: true, data_bit_rate: 2_000_000, bit_rate: 500_000, ..classic };
    let roles = built(&fd, &databases, 0.01).expect("FD");
    let sum = load::worst_case(&roles, &fd);
    // 135 bits; and 34 + 678 / 4 of the 64 bytes: see the tests of `load`.
    let bits: Vec<f64> = sum.messages.iter().map(|message| message.bits).collect();
    assert_eq!(bits, [135.0, 203.5]);
    assert!((sum.percent - 100.0 * 338.5 / 5_000.0).abs() < 1e-9, "{sum:?}");
    let odd = BusConfig { fd: true, ..table(&[(Channel::BatteryVoltage, "ODD.volt")]) };
    assert_eq!(said(&odd), Err(format!("{place}: no frame carries the 9 bytes of `ODD`")));
}

#[test]
fn a_table_that_contradicts_itself_is_refused() {
    let (one, other) = (database(COMMANDS), database(WIDE));
    let mut config = table(&[(Channel::BatteryVoltage, "C.back")]);
    let two = [one, other];
    let said = |config: &BusConfig, databases: &[Database]| built(config, databases, 0.01).map(drop);
    let own = "bus.commands: `C` is also received, as `C`";
    assert_eq!(said(&config, &two), Err(own.to_owned()));
    config.sensors.clear();
    for (length, is_good) in [(0, false), (1, true), (15, true), (16, false)] {
        config.interface = "v".repeat(length);
        assert_eq!(said(&config, &two).is_ok(), is_good, "an interface's name of {length} letters");
    }
    config.interface = "can0".to_owned();
    config.commands.remove(&CommandField::Rotor2);
    let missing = "bus.commands.rotor_2: no signal carries this rotor's command";
    assert_eq!(said(&config, &two), Err(missing.to_owned()));
    let mut twice = table(&[]);
    twice.database.push(DatabaseConfig { file: "other".to_owned(), node_mask: None });
    let several = "bus.commands.rotor_1: several DBC files have a message `C`";
    assert_eq!(said(&twice, &[database(COMMANDS), database(COMMANDS)]), Err(several.to_owned()));
    for period_s in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let mut config = table(&[]);
        let settings = MessageConfig { counter: None, period_s: Some(period_s) };
        config.messages.insert("C".to_owned(), settings);
        let sentence = format!("bus.messages.C.period_s: {period_s} s is not a period");
        assert_eq!(said(&config, &two), Err(sentence));
    }
}

#[test]
fn a_built_in_dbc_file_is_known_by_its_name_and_any_other_is_read() {
    let bytes = |file: &str| DatabaseConfig { file: file.to_owned(), node_mask: None }.bytes();
    for (name, text) in BUILT_IN {
        assert_eq!(bytes(name).expect("built in"), text.as_bytes());
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("own.dbc");
    std::fs::write(&file, "own").expect("written");
    assert_eq!(bytes(&file.display().to_string()).expect("there"), b"own");
    assert!(matches!(bytes("no/such.dbc"), Err(CanError::Read { .. })));
}
