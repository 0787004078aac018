//! Who is on a bus that speaks DroneCAN, as a table.

use super::TextTable;
use crate::can::dronecan::{AllocationEvent, NodeParameter, NodeReport, ParameterValue};

/// The nodes that were heard.
#[must_use]
pub fn nodes(nodes: &[NodeReport]) -> String {
    let columns =
        ["node", "name", "health", "mode", "uptime [s]", "status code", "software", "hardware", "unique id"];
    let mut table = TextTable::new(columns);
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

/// Parameters of a node.
#[must_use]
pub fn parameters(parameters: &[NodeParameter]) -> String {
    let mut table = TextTable::new(["name", "value", "default", "least", "greatest", "type"]);
    for parameter in parameters {
        let shown =
            |value: &Option<ParameterValue>| value.as_ref().map_or_else(String::new, |it| it.to_string());
        table = table.row([
            parameter.name.clone(),
            shown(&parameter.value),
            shown(&parameter.default),
            shown(&parameter.least),
            shown(&parameter.greatest),
            parameter.value.as_ref().map_or("", ParameterValue::name).to_owned(),
        ]);
    }
    table.text()
}

/// What is said where a node has no parameters.
#[must_use]
pub fn no_parameters(node: u8) -> String {
    format!("node {node} has no parameters")
}

/// What is said after a parameter was written and not saved.
pub const NOT_SAVED: &str = "until the node restarts; to keep it beyond: --save";

/// What an allocator did.
#[must_use]
pub fn allocation(event: &AllocationEvent) -> String {
    match event {
        AllocationEvent::Given { unique_id, node_id, is_new } => {
            let again = if *is_new { "" } else { ", as before" };
            format!("{unique_id} is node {node_id}{again}")
        }
        AllocationEvent::NoneLeft { unique_id } => format!("{unique_id} gets no node id: none is left"),
        AllocationEvent::NotKept { error } => {
            format!("no node id is given: the table cannot be written ({error})")
        }
        AllocationEvent::NotAlone { node } => format!("node {node} gives node ids, too"),
    }
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
