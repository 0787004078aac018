//! Numbers that decide what an emulated bench does where its rotors break or its hidden laws end.

crate::thresholds! {
    /// speed of a turning rotor over that which it would have without its propeller, at hover: how much faster a broken one turns.
    loaded_share: f64 = 0.75, "-", "judgement, of multirotors";
    /// share of its thrust that a broken propeller lacks, unless the bench file says another.
    usually_lost: f64 = 0.3, "-", "judgement";
    /// share of its thrust that a broken propeller lacks, at most: without any propeller a motor has no law.
    most_lost: f64 = 0.99, "-", "judgement";
    /// command of an ESC that turns its rotor by itself, unless the bench file says another.
    own_command: f64 = 0.2, "-", "judgement";
    /// least span of commands above a hidden dead zone.
    least_command_span: f64 = 0.01, "-", "judgement: without any the emulator would divide by zero";
    /// least factor on the pole in the emulator's own hidden law of a pole that depends on the speed: the pole never turns round.
    smallest_pole_factor: f64 = 0.05, "-", "judgement; the catalogue's law, which is fitted, has a bound of its own, and only below the greater of the two do they differ";
    /// heights of a hidden ground effect's rotor over its radius: the least that the law is asked at.
    closest_ground: f64 = 0.55, "-", "judgement: the catalogue's law holds down to half a radius";
    /// radius of a hidden ground effect's rotor over its height, from which on the bench file is refused.
    largest_radius: f64 = 2.0, "-", "level, the rotor is half a radius above the floor, down to which the catalogue's law holds";
}
