//! What cannot be is refused in one sentence, with its place.

use std::collections::BTreeMap;

use rotorbench::can::{BusConfig, CanError, CommandField, Database, DatabaseConfig, Roles, SignalConfig};
use rotorbench::signal::Channel;

const HEAD: &str = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\n";

/// What is said of a DBC file of these lines; the first of them is line 9.
fn refusal(body: &str) -> String {
    match Database::parse("x.dbc", format!("{HEAD}{body}\n").as_bytes()) {
        Ok(database) => panic!("accepted: {database:?}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_dbc_file_that_cannot_be_is_refused_with_its_line() {
    let cases = [
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ b : 7|8@1+ (1,0) [0|0] \"\" A",
            "x.dbc:11: message `M`: signals `a` and `b` overlap",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ b : 0|4@0+ (1,0) [0|0] \"\" A",
            "x.dbc:11: message `M`: signals `a` and `b` overlap",
        ),
        // Two of one page; and one of a page in a page, beside one of the outer page.
        (
            "BO_ 1 M: 8 A\n SG_ s M : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ a m1 : 8|8@1+ (1,0) [0|0] \"\" A\n \
             SG_ b m1 : 15|8@1+ (1,0) [0|0] \"\" A",
            "x.dbc:12: message `M`: signals `a` and `b` overlap",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ s M : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ t m0M : 8|8@1+ (1,0) [0|0] \"\" A\n \
             SG_ a m1 : 16|8@1+ (1,0) [0|0] \"\" A\n SG_ b m0 : 16|8@1+ (1,0) [0|0] \"\" A\n\n\
             SG_MUL_VAL_ 1 t s 0-0;\nSG_MUL_VAL_ 1 a t 1-1;\nSG_MUL_VAL_ 1 b s 0-0;",
            "x.dbc:13: message `M`: signals `a` and `b` overlap",
        ),
        (
            "BO_ 1 M: 2 A\n SG_ a : 9|8@1+ (1,0) [0|0] \"\" A",
            "x.dbc:10: message `M`: signal `a` reaches outside the 2 bytes of its message",
        ),
        (
            "BO_ 1 M: 2 A\n SG_ a : 8|2@0+ (1,0) [0|0] \"\" A\n SG_ b : 7|9@0+ (1,0) [0|0] \"\" A",
            "x.dbc:10: message `M`: signal `a` reaches outside the 2 bytes of its message",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|65@1+ (1,0) [0|0] \"\" A",
            "x.dbc:10: message `M`: signal `a` has 65 bits, and a signal has 1 to 64",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|0@1+ (1,0) [0|0] \"\" A",
            "x.dbc:10: message `M`: signal `a` has 0 bits, and a signal has 1 to 64",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|8@1+ (0,0) [0|0] \"\" A",
            "x.dbc:10: message `M`: signal `a` has the factor 0 and the offset 0, and cannot carry a value",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|16@1- (1,0) [0|0] \"\" A\n\nSIG_VALTYPE_ 1 a : 1;",
            "x.dbc:10: message `M`: signal `a` is a 32-bit float of 16 bits",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ a : 8|8@1+ (1,0) [0|0] \"\" A",
            "x.dbc:10: message `M`: two signals have the name `a`",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a m0 : 0|8@1+ (1,0) [0|0] \"\" A",
            "x.dbc:10: message `M`: signal `a` is multiplexed, and no signal selects it",
        ),
        (
            "BO_ 1 M: 8 A\n SG_ a m0M : 0|8@1+ (1,0) [0|0] \"\" A\n\nSG_MUL_VAL_ 1 a a 0-0;",
            "x.dbc:10: message `M`: signal `a` selects itself through its multiplexers",
        ),
        ("BO_ 1 M: 8 A\n\nBO_ 1 N: 8 A", "x.dbc:11: message `N` has the identifier of the one in line 9"),
        (
            "BO_ 2048 M: 8 A",
            "x.dbc:9: identifier 2048 has more than 11 bits (a 29-bit identifier has bit 31 set)",
        ),
        // `can-dbc` alone would take these two as 1.
        (
            "BO_ 65537 M: 8 A",
            "x.dbc:9: identifier 65537 has more than 11 bits (a 29-bit identifier has bit 31 set)",
        ),
        ("BO_ 2684354560 M: 8 A", "x.dbc:9: identifier 2684354560 has more than 29 bits"),
        ("BO_ 2684354561 M: 8 A", "x.dbc:9: identifier 2684354561 has more than 29 bits"),
        (
            "BO_ 1 M: 8 A\n SG_ a : 0|32@1- (1,0) [0|0] \"\" A\n\nSIG_VALTYPE_ 1 A : 1;",
            "x.dbc:9: SIG_VALTYPE_ names the signal `A`, which message 1 does not have",
        ),
        ("BO_ 1 M: 65 A", "x.dbc:9: message `M`: 65 bytes, and a frame carries at most 64"),
    ];
    for (body, sentence) in cases {
        assert_eq!(refusal(body), sentence, "{body}");
    }
    let error = refusal("BO_ 1 M: 8 A\n SG_ a : 0|8@1+ (1,0 [0|0] \"\" A");
    assert!(error.starts_with("x.dbc:10:") && error.contains("not DBC: expected"), "{error}");
}

#[test]
fn what_tools_write_is_accepted() {
    let text = "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n SG_ lost : 0|8@1+ (1,0) [0|0] \"\" A\n\n\
                BO_ 7 Short: 8 A\n SG_ t : 0|8@1+ (1,0) [0|0] \"\u{b0}C\" A\n\nBO_ 8 Plain: 8 A\n SG_ p : 0|8@1+ (1,0) [0|0] \"\" A\n\nCM_ BO_ 7 \"first line\nBO_ 70000 in a comment\";\n\
                BA_DEF_ BO_ \"SystemMessageLongSymbol\" STRING ;\nBA_DEF_DEF_ \"SystemMessageLongSymbol\" \"\";\n\
                BA_ \"SystemMessageLongSymbol\" BO_ 7 \"A_Name_Longer_Than_Thirty_Two_Characters\";\n\
                BA_ \"SystemMessageLongSymbol\" BO_ 8 \"\";\n";
    let utf8 = format!("\u{feff}{HEAD}{text}");
    let cp1252: Vec<u8> = format!("{HEAD}{text}").chars().map(|letter| letter as u8).collect();
    for bytes in [utf8.as_bytes(), &cp1252] {
        let database = Database::parse("x.dbc", bytes).expect("what tools write");
        assert!(database.message("Plain").is_some(), "an empty long name is none");
        let message = database.message("A_Name_Longer_Than_Thirty_Two_Characters").expect("the long name");
        assert_eq!((database.messages.len(), message.signals[0].unit.as_str()), (2, "°C"));
    }
}

/// A comment of two lines has ended where it ends: what is behind it has a line.
#[test]
fn what_stands_behind_a_long_text_has_its_line() {
    let text = "VERSION \"first\nsecond\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\nBO_ 1 M: 2 A\n SG_ a : 9|8@1+ (1,0) [0|0] \"\" A\n";
    let error = Database::parse("x.dbc", text.as_bytes()).expect_err("it reaches outside").to_string();
    assert!(error.starts_with("x.dbc:11: message `M`"), "{error}");
}

#[test]
fn a_table_says_no_more_than_it_must() {
    let text = toml::to_string(&SignalConfig::new("GYRO.rate")).expect("a table");
    assert_eq!(text, "signal = \"GYRO.rate\"\n");
}

/// What is said of the default `[bus]` table with something changed.
fn role_refusal(change: impl FnOnce(&mut BusConfig)) -> String {
    let mut config = BusConfig::default();
    change(&mut config);
    match Roles::build(&config, 0.02) {
        Ok(_) => panic!("accepted: {config:?}"),
        Err(error) => error.to_string(),
    }
}

fn gyro(config: &mut BusConfig) -> &mut SignalConfig {
    config.sensors.get_mut(&Channel::BodyRate).expect("there")
}

#[test]
fn a_role_that_cannot_be_filled_is_refused_with_its_place() {
    let said = [
        role_refusal(|bus| gyro(bus).signal = "GYRO.speed".to_owned()),
        role_refusal(|bus| gyro(bus).signal = "GYRO".to_owned()),
        role_refusal(|bus| gyro(bus).signal = "GYRO.temperature".to_owned()),
        role_refusal(|bus| gyro(bus).signal = "GYRO.counter".to_owned()),
        role_refusal(|bus| gyro(bus).signal = "ESC_1_STATUS.speed".to_owned()),
        role_refusal(|bus| gyro(bus).unit = Some("rads".to_owned())),
        role_refusal(|bus| gyro(bus).pole_pairs = Some(7)),
        role_refusal(|bus| gyro(bus).node = Some(1)),
        role_refusal(|bus| gyro(bus).factor = 0.0),
        role_refusal(|bus| gyro(bus).minimum = Some(50.0)),
        role_refusal(|bus| drop(bus.commands.pop_first())),
        role_refusal(|bus| bus.interface = "a-name-too-long-for-it".to_owned()),
        role_refusal(|bus| bus.messages.entry("GYR0".to_owned()).or_default().period_s = Some(1.0)),
        role_refusal(|bus| bus.messages.entry("GYRO".to_owned()).or_default().period_s = Some(0.0)),
        role_refusal(|bus| {
            bus.messages.entry("GYRO".to_owned()).or_default().counter = Some("rate".to_owned())
        }),
    ];
    let wanted = [
        "bus.sensors.body_rate: message `GYRO` has no signal `speed`; it has `counter`, `temperature`, `rate`",
        "bus.sensors.body_rate: `GYRO` is not of the form MESSAGE.signal",
        "bus.sensors.body_rate: `GYRO.temperature`: unit `degC` measures K, but rad/s is needed: `rad/s`, `deg/s`, `°/s`, `dps`, `rpm`, `RPM`, `Hz`, `rev/s`, `krpm`",
        "bus.sensors.body_rate: `GYRO.counter`: unit `` measures -, but rad/s is needed: `rad/s`, `deg/s`, `°/s`, `dps`, `rpm`, `RPM`, `Hz`, `rev/s`, `krpm`",
        "bus.sensors.propeller_rate_1: `ESC_1_STATUS.speed` is already `sensors.body_rate`",
        "bus.sensors.body_rate: `GYRO.rate`: unknown unit `rads`; for what is measured in rad/s: `rad/s`, `deg/s`, `°/s`, `dps`, `rpm`, `RPM`, `Hz`, `rev/s`, `krpm`",
        "bus.sensors.body_rate: `GYRO.rate`: pole_pairs belong to the unit ERPM, and this is `rad/s`",
        "bus.sensors.body_rate: a node needs the node_mask of its DBC file",
        "bus.sensors.body_rate: `GYRO.rate`: factor 0 cannot carry a value",
        "bus.sensors.body_rate: `GYRO.rate`: no value lies between the minimum 50 and the maximum 40",
        "bus.commands.rotor_1: no signal carries this rotor's command",
        "bus.interface: `a-name-too-long-for-it` cannot be the name of an interface",
        "bus.messages.GYR0: no role uses this message: take it out, or name one of its signals in bus.sensors",
        "bus.messages.GYRO.period_s: 0 s is not a period",
        "bus.messages.GYRO.counter: `rate` must be a plain unsigned integer",
    ];
    for (said, wanted) in said.iter().zip(wanted) {
        assert_eq!(said, wanted);
    }
}

/// The guide's own example. The counters that the built-in bench checks are not the user's to take back.
#[test]
fn who_lists_other_roles_need_not_repeat_the_messages() {
    let text = "[sensors]\nbody_angle = { signal = \"ENCODER.angle\" }";
    let config: BusConfig = toml::from_str(text).expect("sound");
    let roles = Roles::build(&config, 0.02).expect("sound");
    let messages: Vec<&str> = roles.sensor_messages().iter().map(|it| it.name.as_str()).collect();
    assert_eq!(messages, ["ENCODER"]);
}

/// An ESC that reads 1000..2000 µs gets its zero at 1000; one whose signal starts above its zero would never be commanded to
/// stand still.
#[test]
fn commands_that_cannot_say_zero_are_refused() {
    let roles = |scaling: &str, rotor_2: &str| {
        let text = format!(
            "{HEAD}BO_ 1 C: 8 A\n SG_ m M : 0|8@1+ (1,0) [0|0] \"\" A\n SG_ one m0 : 16|16@1+ {scaling} [0|0] \"\" A\n \
             SG_ two {rotor_2} : 32|16@1+ {scaling} [0|0] \"\" A\n"
        );
        let databases = [Database::parse("x.dbc", text.as_bytes()).expect("DBC")];
        let mut config =
            BusConfig { sensors: BTreeMap::new(), messages: BTreeMap::new(), ..BusConfig::default() };
        config.commands = [(CommandField::Rotor1, "C.one"), (CommandField::Rotor2, "C.two")]
            .map(|(field, signal)| (field, SignalConfig::new(signal)))
            .into();
        Roles::resolve(&config, &databases, 0.02).map(drop).map_err(|error| error.to_string())
    };
    assert_eq!(roles("(0.001,-1)", "m0"), Ok(()));
    assert_eq!(
        roles("(0.001,0.1)", "m0"),
        Err("bus.commands.rotor_1: `one` cannot say 0: it would say 0.1".to_owned())
    );
    let shared = "bus.commands: `C` is multiplexed: one frame cannot carry all its commands";
    assert_eq!(roles("(0.001,0)", "m1"), Err(shared.to_owned()));
}

#[test]
fn electrical_revolutions_need_pole_pairs_and_a_node_its_mask() {
    let vesc = |pole_pairs, node, node_mask| {
        role_refusal(|bus| {
            bus.database.push(DatabaseConfig { file: "vesc".to_owned(), node_mask });
            let role = SignalConfig { pole_pairs, node: Some(node), ..SignalConfig::new("STATUS.erpm") };
            bus.sensors.insert(Channel::PropellerRate1, role);
        })
    };
    let place = "bus.sensors.propeller_rate_1";
    assert_eq!(
        vesc(None, 23, Some(0xFF)),
        format!("{place}: `STATUS.erpm`: ERPM become a rotor's speed only through pole_pairs")
    );
    assert_eq!(vesc(Some(7), 256, Some(0xFF)), format!("{place}: node 256 does not fit the node_mask 0xFF"));
    assert_eq!(vesc(Some(7), 1, None), format!("{place}: a node needs the node_mask of its DBC file"));
}

#[test]
fn a_bus_without_a_message_is_refused() {
    let said = role_refusal(|bus| bus.database.clear());
    assert!(said.contains("no DBC file has a message `") && said.ends_with("; they hold none"), "{said}");
}

#[test]
fn a_missing_file_and_a_full_bus_are_refused() {
    let config = BusConfig {
        database: vec![DatabaseConfig { file: "no/such.dbc".to_owned(), node_mask: None }],
        ..BusConfig::default()
    };
    let Err(CanError::Read { file, .. }) = Roles::build(&config, 0.02) else {
        panic!("there is no such file")
    };
    assert_eq!(file, "no/such.dbc");
    let error =
        Roles::build(&BusConfig::default(), 0.000_5).map(drop).expect_err("67.5 % at 1 kHz is 135 % at 2");
    assert_eq!(
        error.to_string(),
        "the bus would be 135.0 % loaded at worst, over 100 %: send less often or raise bit_rate"
    );
}

#[test]
fn a_table_with_an_unknown_key_is_refused_with_its_name() {
    for text in [
        "interfase = 'can0'",
        "[sensors]\nbodyrate = { signal = 'A.b' }",
        "[sensors.body_rate]\nsignal = 'A.b'\nunits = 'V'",
    ] {
        let error = toml::from_str::<BusConfig>(text).expect_err(text).to_string();
        assert!(error.contains("unknown") && error.contains("line"), "{error}");
    }
}
