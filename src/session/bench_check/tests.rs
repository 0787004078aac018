use std::path::Path;

use super::*;
use crate::can::protocol;

#[test]
fn a_long_hold_is_warned_of() {
    let found = |text: &str| {
        let config = BenchConfig::parse(text, Path::new("bench.toml")).expect("a bench file");
        let spoken = protocol(&config.bus, config.period_s).expect("a bus");
        let guard = config.guard.build(config.period_s).expect("a guard");
        let check = BenchCheck::of(&config, &*spoken, (&guard, &Model::paper())).expect("resolved");
        check.caveats.iter().any(|it| it.code == "long_hold")
    };
    assert_eq!([found("guard.hold_s = 10.0"), found("guard.hold_s = 0.5"), found("")], [true, false, false]);
}

#[test]
fn a_required_signal_of_no_node_is_an_obstacle() {
    let found = |node: &str| {
        let text = format!(
            "[[bus.database]]\nfile = \"vesc\"\nnode_mask = 0xFF\n[[bus.database]]\nfile = \"bench\"\n[bus.messages]\n\
             [bus.sensors]\npropeller_rate_1 = {{ signal = \"STATUS.erpm\", pole_pairs = 7{node} }}\n"
        );
        let config = BenchConfig::parse(&text, Path::new("bench.toml")).expect("a bench file");
        let spoken = protocol(&config.bus, config.period_s).expect("a bus").messages();
        let guard = config.guard.build(config.period_s).expect("a guard");
        assert_eq!(
            omitted(&config, &spoken, &guard).iter().filter(|it| it.code == "node_not_named").count(),
            0
        );
        obstacles(&config, &spoken, &guard).iter().any(|it| it.code == "node_not_named")
    };
    assert_eq!([found(""), found(", node = 23")], [true, false]);
}

#[test]
fn what_a_changed_bench_file_omits_is_found() {
    let found = |text: &str| {
        let config = BenchConfig::parse(text, Path::new("bench.toml")).expect("a bench file");
        let spoken = protocol(&config.bus, config.period_s).expect("a bus");
        let guard = config.guard.build(config.period_s).expect("a guard");
        let found = omitted(&config, &spoken.messages(), &guard).into_iter();
        found.map(|it| (it.code, it.subject)).collect::<Vec<_>>()
    };
    assert_eq!(found(""), []);
    let odrives = |node: &str, messages: &str| {
        format!(
            "[[bus.database]]\nfile = \"odrive\"\nnode_mask = 0x7E0\n[bus.commands]\n\
             rotor_1 = {{ signal = \"SET_INPUT_TORQUE.torque\", unit = \"-\"{node} }}\n\
             rotor_2 = {{ signal = \"SET_INPUT_TORQUE.torque\", unit = \"-\", node = 3 }}\n[bus.sensors]\n{messages}"
        )
    };
    let one = "SET_INPUT_TORQUE (node 3)";
    assert_eq!(found(&odrives(", node = 0", "[bus.messages]\n")), []);
    let nodeless = || ("node_not_named", "SET_INPUT_TORQUE".to_owned());
    assert_eq!(found(&odrives("", "[bus.messages]\n")), [nodeless()]);
    let counters = ("counters_of_other_messages", format!("SET_INPUT_TORQUE, {one}"));
    assert_eq!(found(&odrives("", "")), [nodeless(), counters]);
}

#[test]
fn an_interface_that_is_not_there_is_found_and_keeps_no_bench_from_being_checked() {
    let codes = |look| {
        let found = interface_findings(&BenchConfig::default(), &look);
        found.iter().map(|it| it.code).collect::<Vec<_>>()
    };
    assert_eq!(codes(InterfaceLook::Missing), ["interface_missing"]);
    assert_eq!(codes(InterfaceLook::NoCan), [""; 0]);
    let down = InterfaceStatus {
        index: 3,
        is_up: false,
        fd: true,
        state: None,
        restart_ms: None,
        bit_rate: None,
        data_bit_rate: None,
        error_counters: None,
    };
    assert_eq!(codes(InterfaceLook::There(down)), ["interface_down"]);
    let group = || MulticastGroup { number: 0, device: "eth1".to_owned() };
    let device = |is_up, is_loopback| Some(NetworkDevice { index: 2, is_up, is_loopback });
    assert_eq!(codes(InterfaceLook::Multicast(group(), None)), ["interface_missing"]);
    assert_eq!(codes(InterfaceLook::Multicast(group(), device(false, true))), ["interface_down"]);
    assert_eq!(codes(InterfaceLook::Multicast(group(), device(true, false))), ["multicast_leaves_machine"]);
    assert_eq!(codes(InterfaceLook::Multicast(group(), device(true, true))), [""; 0]);
}
