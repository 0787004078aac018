//! Tables of a bench on DroneCAN that cannot be.

use rotorbench::can::dronecan::{CommandKind, NodeId};
use rotorbench::can::{BusConfig, DatabaseConfig, MessageConfig, SignalConfig, protocol};
use rotorbench::signal::Channel;

use super::dronecan_bench::config;

#[test]
fn a_table_that_cannot_be_is_refused_with_its_place() {
    let said = |change: &dyn Fn(&mut BusConfig)| {
        let mut config = config();
        change(&mut config);
        protocol(&config, 0.02).map(drop).expect_err("refused").to_string()
    };
    let role = |signal: &str| {
        let signal = SignalConfig::new(signal);
        move |config: &mut BusConfig| {
            config.sensors = [(Channel::Thrust1, signal.clone())].into();
        }
    };
    let period = |name: &str, period_s| {
        let name = name.to_owned();
        move |config: &mut BusConfig| {
            config.messages.insert(name.clone(), MessageConfig { counter: None, period_s: Some(period_s) });
        }
    };
    type Change<'a> = &'a dyn Fn(&mut BusConfig);
    let cases: &[(Change<'_>, &str)] = &[
        (
            &|it| it.database = vec![DatabaseConfig { file: "vesc".to_owned(), node_mask: None }],
            "bus.database: ",
        ),
        (&|it| it.commands.clear(), "bus.commands: "),
        (&|it| it.interface.clear(), "bus.interface: "),
        (&|it| it.dronecan.node_id = NodeId::Fixed(128), "bus.dronecan.node_id: 128 is no node id"),
        (&|it| it.dronecan.esc_index = [1, 1], "bus.dronecan.esc_index: "),
        (&|it| it.dronecan.esc_index = [1, 20], "bus.dronecan.esc_index: "),
        (&|it| it.dronecan.raw_maximum = 0, "bus.dronecan.raw_maximum: 0"),
        (&|it| it.dronecan.command = CommandKind::Rpm, "bus.dronecan.rpm_maximum: "),
        (&|it| it.dronecan.rpm_maximum = Some(200_000), "bus.dronecan.rpm_maximum: 200000"),
        (&|it| it.bit_rate = 10_000, "the bus would be"),
        (&role("uavcan.equipment.esc.Status.speed"), "there is no field `speed`; there are `error_count`"),
        (
            &role("uavcan.equipment.esc.Statu.rpm"),
            "bus.sensors.thrust_1: `uavcan.equipment.esc.Statu.rpm`: no type",
        ),
        (&role("uavcan.equipment.esc.Status.rpm"), "`rpm`"),
        (&role("uavcan.equipment.esc.Status.error_count"), "DSDL says no unit"),
        (&role("uavcan.Timestamp.usec"), "the type has no id"),
        (&role("uavcan.protocol.GetNodeInfo.name"), "this is a service"),
        (&role("GYRO.rate"), "no type of DSDL has this name"),
        (&period("uavcan.equipment.esc.Status", -1.0), "bus.messages.uavcan.equipment.esc.Status.period_s: "),
        (&period("uavcan.equipment.power.BatteryInfo", 1.0), "no role uses this message"),
    ];
    for (change, words) in cases {
        let said = said(change);
        assert!(said.contains(words), "{words}: {said}");
    }
    let of_node = |change: &dyn Fn(&mut SignalConfig)| {
        said(&|config: &mut BusConfig| {
            let mut role = SignalConfig::new("uavcan.equipment.ahrs.RawIMU.rate_gyro_latest[2]");
            change(&mut role);
            config.sensors = [(Channel::BodyRate, role)].into();
        })
    };
    assert!(of_node(&|role| role.node = Some(0)).contains("a node id is 1 to 127"));
    assert!(of_node(&|role| role.node = Some(100)).contains("100 is the bridge's own node id"));
    assert!(of_node(&|role| role.esc = Some(1)).contains("no field `esc_index`"));
    assert!(of_node(&|role| role.factor = 0.0).contains("cannot carry a value"));
    assert!(of_node(&|role| role.minimum = Some(1e9)).contains("no value lies between"));
    // And of the other protocol.
    let mut dbc = BusConfig::default();
    dbc.dronecan.node_id = NodeId::Fixed(7);
    assert!(protocol(&dbc, 0.02).map(drop).expect_err("refused").to_string().starts_with("bus.dronecan: "));
    let mut dbc = BusConfig::default();
    dbc.sensors.get_mut(&Channel::BodyRate).expect("built in").esc = Some(1);
    assert!(protocol(&dbc, 0.02).map(drop).expect_err("refused").to_string().contains("`esc` belongs to"));
}
