//! The catalogue as `effects` prints it.

use std::fmt::Write as _;

use crate::effect::{CATALOGUE, Card};
use crate::model::{Model, UserEffect};

/// Each effect on a line, those of the model's user behind them.
#[must_use]
pub fn list(model: &Model) -> String {
    let mut text = String::new();
    for card in CATALOGUE {
        let _ = writeln!(text, "{:<24} {:<18} {}", card.id, card.site.name(), card.meaning);
    }
    for user in &model.user_effects {
        let _ = writeln!(text, "{:<24} {:<18} {} (your own)", user.id, user.site.name(), user.expression);
    }
    text
}

/// A law of one's own.
#[must_use]
pub fn own_card(own: &UserEffect) -> String {
    format!("{} ({}): {}\n  {}\n", own.id, own.site.name(), own.expression, own.meaning)
}

/// A card.
#[must_use]
pub fn card(card: &Card) -> String {
    let mut text = format!("{}: {}\n\n  {} {}\n\n", card.id, card.meaning, card.report[0], card.report[1]);
    let mut line = |name: &str, said: &str| {
        let _ = writeln!(text, "  {name:<15}{said}");
    };
    line("equation", card.equation);
    line("acts on", card.site.name());
    line("source", card.source);
    for parameter in card.parameters {
        line(
            "parameter",
            &format!(
                "{} ({}) [{}]: {}; {} to {}, from {}",
                parameter.name,
                parameter.symbol,
                parameter.unit,
                parameter.meaning,
                parameter.lower,
                parameter.upper,
                parameter.start
            ),
        );
    }
    line("needs", &card.needs.join(", "));
    line("in the error", card.residual);
    let confused_with = card.confused_with.join(", ");
    line("confused with", if card.confused_with.is_empty() { "-" } else { &confused_with });
    line("experiment", card.experiment);
    text
}
