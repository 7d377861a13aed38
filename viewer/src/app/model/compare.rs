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
    /// All of them, with their names.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Split, "Split"),
        (Self::Flicker, "Flicker"),
        (Self::Difference, "Difference"),
        (Self::Tile, "Tile"),
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
