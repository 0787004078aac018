//! Numbers that decide how far laws hold, and which expressions are read.

crate::thresholds! {
    /// least factor on the pole in the catalogue's law of a pole that depends on the speed, as models and fits have it: the pole never
    /// turns round, however far from hover.
    smallest_pole_factor: f64 = 0.02, "-", "judgement; the emulator's law has a bound of its own, and only below the greater of the two do they differ";
    /// largest R/(4 h) of a rotor above the floor: the law holds down to half a radius above it, and nearer it would divide by zero.
    largest_ground_ratio: f64 = 0.9, "-", "judgement";
    /// brackets within brackets, and signs before signs, of an expression.
    deepest_brackets: usize = 64, "count", "judgement: the reader calls itself for each, and a stack ends";
    /// words and signs of one expression.
    longest_expression: usize = 1000, "count", "judgement";
    /// characters of an expression that an error shows to either side of its place.
    shown_characters: usize = 60, "count", "judgement: it fits a line";
}
