//! What is compared with what, and how both are shown.

/// How two pictures are shown at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// One beside the other, with a divider between.
    #[default]
    Split,
    /// One after the other.
    Flicker,
    /// Their difference.
    Difference,
    /// The second one is the middle of the picture, drawn while the view rests.
    Tile,
}

impl Mode {
    /// All of them, with what they are called and what they show.
    pub const ALL: [(Self, &'static str, &'static str); 4] = [
        (Self::Split, "Split", "A beside B; drag the line between them"),
        (Self::Flicker, "Flicker", "A and B in turn"),
        (
            Self::Difference,
            "Difference",
            "How far A is from B, by FLIP: dark where they look the same",
        ),
        (
            Self::Tile,
            "Tile",
            "B as a tile in the middle of A, drawn while nothing moves",
        ),
    ];
}

/// What is compared with what.
#[derive(Clone, Debug, PartialEq)]
pub struct Compare {
    /// Whether anything is.
    pub on: bool,
    /// How both are shown.
    pub mode: Mode,
    /// Name of the second renderer.
    pub renderer: String,
    /// Whether the second picture is of the other recording.
    pub other: bool,
    /// Share of the width that the first picture has.
    pub divider: f32,
    /// How often a second the pictures change places.
    pub rate: f32,
}
