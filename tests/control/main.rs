//! The control room in closed loop on a plant of the test's own (shares no code with `emulate` or `model`):
//! promised margins against measured ones, known physics against unknown, no allocation in any step.

mod allocation;
mod margins;
mod physics;
mod reference;
mod truth;
