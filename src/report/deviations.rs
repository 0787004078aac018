//! Where this program departs from the print of [LPC16], for the reader of the report; docs/deviations.md has the same list.

use super::TextTable;

/// Place in the print, what is printed there, what is used here.
pub const DEVIATIONS: &[[&str; 3]] = &[
    [
        "(1) against (12)-(16)",
        "both signs",
        "torque = d (f_1 - f_2): u_x = g(u_1) - g(u_2) drives the angle up",
    ],
    [
        "(1), Table IV: d",
        "the distance between the axes; the arm's length",
        "the lever arm of each rotor, 0.25 m, as (1) uses it",
    ],
    [
        "(2) (4) (5) (9) against (6)",
        "+ k_V (v_bmax - v_b)",
        "z = g(u) - k_V (v_bmax - v_b): a rotor slows down as its battery drops",
    ],
    ["below (2)", "ω_b is the propeller's rate", "ω_p"],
    ["(3) against (6)", "1000, then 3000 samples", "what the log holds"],
    [
        "(6)",
        "plain least squares",
        "mean subtracted, the voltage's smooth course as instrument, in the joint fit with what the commands draw (plain least squares is biased to zero by voltage noise)",
    ],
    [
        "(9)",
        "powers of u alone",
        "the powers as they arrive behind the rotor's lag: fitted with them where ramps go up and down, else as exciting commands show it",
    ],
    [
        "(10)",
        "the pole alone",
        "a gain and an offset are fitted beside the pole, and shown; the model keeps gain 1, and gets a delay where the data settle one",
    ],
    ["(15)", "ω̇_b = -p ω̇_b + ...", "q̇_b = -p q_b + p b u_x"],
    [
        "(16) for limited commands",
        "g(u_1) - g(u_2)",
        "the difference about hover that gives the same torque with f = c ω²",
    ],
    ["(28)", "e = x_c - x̂_c - Q x_d", "the first x_c is the reference, its underline is lost"],
    [
        "(13), Fig. 4, Table IV",
        "thrust curve not given",
        "f = c ω² with the printed tangent: c = 1.5965e-5 N s²/rad², hover at 617.0 rad/s",
    ],
    [
        "Table IV: β",
        "0.27",
        "β is a design input: zero-order hold by default (0.2739), 0.276 reproduces Table II",
    ],
    [
        "Table III: K",
        "0.276, 0.120, 0.052",
        "these are γ_0, γ_1, γ_2 and as gains unstable (modulus 1.171); pole placement instead: K = 0.07618, 0.828, 2.0",
    ],
];

/// All of them.
pub(super) fn table() -> TextTable {
    let table = TextTable::new(["place", "printed", "used here"])
        .caption("Where the print contradicts itself, or leaves something out");
    DEVIATIONS.iter().fold(table, |table, row| table.row(*row))
}
