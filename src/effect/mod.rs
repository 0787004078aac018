//! Physical effects: the card, the catalogue, one file per effect.
