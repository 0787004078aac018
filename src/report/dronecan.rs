//! Who is on a bus that speaks DroneCAN, as a table.

use super::Table;
use crate::can::dronecan::NodeReport;

/// The nodes that were heard.
#[must_use]
pub fn nodes(nodes: &[NodeReport]) -> String {
    let columns =
        ["node", "name", "health", "mode", "uptime [s]", "status code", "software", "hardware", "unique id"];
    let mut table = Table::new(columns);
    for node in nodes {
        let known = |of: &dyn Fn(&crate::can::dronecan::NodeInfo) -> String| {
            node.info.as_ref().map_or_else(|| "no answer".to_owned(), of)
        };
        let version = |(major, minor): (u8, u8)| format!("{major}.{minor}");
        table = table.row([
            node.id.to_string(),
            known(&|it| it.name.clone()),
            health(node.health),
            mode(node.mode),
            node.uptime_s.to_string(),
            node.code.to_string(),
            known(&|it| version(it.software)),
            known(&|it| version(it.hardware)),
            known(&|it| it.unique_id.iter().map(|byte| format!("{byte:02x}")).collect()),
        ]);
    }
    table.text()
}

/// What is said where nobody was heard.
#[must_use]
pub fn nobody(interface: &str, seconds: f64) -> String {
    format!("no node of DroneCAN was heard on {interface} in {seconds} s")
}

fn health(code: u8) -> String {
    ["ok", "warning", "error", "critical"]
        .get(usize::from(code))
        .map_or_else(|| code.to_string(), |it| (*it).to_owned())
}

fn mode(code: u8) -> String {
    match code {
        0 => "operational".to_owned(),
        1 => "initialization".to_owned(),
        2 => "maintenance".to_owned(),
        3 => "software update".to_owned(),
        7 => "offline".to_owned(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::dronecan::NodeInfo;

    #[test]
    fn a_node_that_did_not_answer_is_shown_all_the_same() {
        let info =
            NodeInfo { name: "own".to_owned(), software: (1, 2), hardware: (3, 4), unique_id: vec![0xAB, 1] };
        let one = NodeReport { id: 7, health: 3, mode: 7, uptime_s: 9, code: 5, info: Some(info) };
        let text = nodes(&[one, NodeReport { id: 8, mode: 5, ..NodeReport::default() }]);
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert!(
            lines.contains(&vec!["7", "own", "critical", "offline", "9", "5", "1.2", "3.4", "ab01"]),
            "{text}"
        );
        assert!(text.contains("no answer") && text.contains("ok"), "{text}");
    }
}
