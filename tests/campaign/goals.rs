//! The goals that a score is held against.

use crate::score::{BESIDE, Judged, Mark, NOTHING_BUT, effects, is_strong};

fn per_cent(part: usize, whole: usize) -> String {
    if whole == 0 { "-".to_owned() } else { format!("{:.0} %", 100.0 * part as f64 / whole as f64) }
}

/// The goals, and whether all are reached.
pub fn goals(cases: &[Judged]) -> (String, bool) {
    let strong: Vec<&Judged> = cases.iter().filter(|case| is_strong(case)).collect();
    if cases.iter().any(|case| case.is_own_base) {
        return own_base_goals(&strong);
    }
    let of = |pick: &dyn Fn(&str) -> bool| -> Vec<&Judged> {
        strong.iter().filter(|case| pick(&case.truth)).copied().collect()
    };
    let special = |truth: &str| {
        truth == "none"
            || truth.starts_with(NOTHING_BUT)
            || truth == "unknown"
            || truth.ends_with("_change")
            || truth.ends_with(BESIDE)
    };
    let mut out = String::from("| goal | reached | of | |\n|---|---|---|---|\n");
    let mut all_reached = true;
    let mut line = |name: &str, group: &[&Judged], least: f64| {
        let right = group.iter().filter(|case| case.mark.is_right()).count();
        if !group.is_empty() {
            let reached = right as f64 >= least * group.len() as f64;
            all_reached &= reached;
            let verdict = if reached { "yes" } else { "**no**" };
            out.push_str(&format!(
                "| {name} | {} | {} | {verdict} |\n",
                per_cent(right, group.len()),
                group.len()
            ));
        }
    };
    line("one effect: named or indistinguishable ≥ 95 %", &of(&|t| !special(t) && effects(t) == 1), 0.95);
    line("two effects: named or indistinguishable ≥ 85 %", &of(&|t| effects(t) == 2), 0.85);
    line("three effects: named or indistinguishable ≥ 85 %", &of(&|t| effects(t) == 3), 0.85);
    line("nothing hidden: quiet ≥ 98 %", &of(&|t| t == "none"), 0.98);
    line("law outside the catalogue: unknown ≥ 90 %", &of(&|t| t == "unknown"), 0.90);
    line("parameter of the base changed: reported ≥ 95 %", &of(&|t| t.ends_with("_change")), 0.95);
    let three: Vec<&Judged> = of(&|truth| effects(truth) == 3);
    let wrong: Vec<&Judged> = three.iter().filter(|case| !case.mark.is_right()).copied().collect();
    if !three.is_empty() {
        let sum = |of: &dyn Fn(&Judged) -> (usize, usize)| {
            wrong.iter().fold((0, 0), |sum, case| (sum.0 + of(case).0, sum.1 + of(case).1))
        };
        let ((is_true, named), (is_sure, sure)) = (sum(&|case| case.named), sum(&|case| case.common));
        let reached = is_true as f64 >= 0.95 * named as f64;
        all_reached &= reached;
        let verdict = if reached { "yes" } else { "**no**" };
        out.push_str(&format!(
            "| three effects, elsewhere: of the named ones true ≥ 95 % | {} | {named} | {verdict} |\n\
             | three effects, elsewhere: of those that every set has, which the answer is sure of, true | {} | {sure} | |\n",
            per_cent(is_true, named),
            per_cent(is_sure, sure)
        ));
        let further = wrong.iter().filter(|case| case.is_further).count();
        out.push_str(&format!(
            "| three effects, elsewhere: the right set among those listed further down | {} | {} | |\n",
            per_cent(further, wrong.len()),
            wrong.len()
        ));
    }
    let named: Vec<&Judged> =
        strong.iter().filter(|c| c.mark.is_right() && !special(&c.truth)).copied().collect();
    let at_floor = named.iter().filter(|c| c.over_floor.is_some_and(|r| r <= 1.1)).count();
    out.push_str(&format!(
        "| where named: extended error within 10 % of the floor | {} | {} | |\n",
        per_cent(at_floor, named.len()),
        named.len()
    ));
    let (close, given) = named.iter().fold((0, 0), |s, c| (s.0 + c.parameters.0, s.1 + c.parameters.1));
    out.push_str(&format!(
        "| where named: parameters within 10 % or 3 standard errors | {} | {given} | |\n",
        per_cent(close, given)
    ));
    let noisy: Vec<&Judged> = of(&|truth| truth.starts_with(NOTHING_BUT));
    if !noisy.is_empty() {
        let unknown = noisy.iter().filter(|case| case.said.starts_with("unknown")).count();
        let named = noisy.iter().filter(|case| case.mark == Mark::FalseAlarm).count() - unknown;
        for (what, most, found) in [("something named", 2, named), ("`unknown`", 5, unknown)] {
            let reached = 100 * found <= most * noisy.len();
            all_reached &= reached;
            let (share, verdict) = (per_cent(found, noisy.len()), if reached { "yes" } else { "**no**" });
            out.push_str(&format!(
                "| nothing hidden, noise that is not white: {what} ≤ {most} % | {share} | {} | {verdict} |\n",
                noisy.len()
            ));
        }
    }
    let beside: Vec<&Judged> = cases.iter().filter(|case| case.truth.ends_with(BESIDE)).collect();
    let (held, of) = beside.iter().fold((0, 0), |s, c| (s.0 + c.intervals.0, s.1 + c.intervals.1));
    if of > 0 {
        let share = per_cent(held, of);
        out.push_str(&format!(
            "| beside a small effect: stated 95 % intervals that hold ≥ 90 % | {share} | {of} | |\n"
        ));
    }
    (out, all_reached)
}

/// What it is, of which cases, which of them reach it, and what share must.
type Goal<'a> = (&'a str, &'a [&'a Judged], fn(&Judged) -> bool, Option<f64>);

/// The goals where the base is of the same log. What it takes up is not missing: the answer may then be that nothing is.
fn own_base_goals(strong: &[&Judged]) -> (String, bool) {
    let (quiet, hidden): (Vec<&Judged>, Vec<&Judged>) = strong.iter().partition(|case| case.truth == "none");
    let rows: [Goal; 3] = [
        (
            "one effect or two: named, or nothing wrong ≥ 90 %",
            &hidden,
            Judged::names_nothing_wrong,
            Some(0.9),
        ),
        ("one effect or two: named or indistinguishable", &hidden, |case| case.mark.is_right(), None),
        ("nothing hidden: quiet ≥ 98 %", &quiet, |case| case.mark.is_right(), Some(0.98)),
    ];
    let mut out = String::from("| goal | reached | of | |\n|---|---|---|---|\n");
    let mut all_reached = true;
    for (name, group, is_right, least) in rows {
        let right = group.iter().filter(|case| is_right(case)).count();
        let verdict = match least {
            Some(least) if right as f64 >= least * group.len() as f64 => "yes",
            Some(_) => "**no**",
            None => "",
        };
        all_reached &= verdict != "**no**";
        out.push_str(&format!(
            "| {name} | {} | {} | {verdict} |\n",
            per_cent(right, group.len()),
            group.len()
        ));
    }
    (out, all_reached)
}
