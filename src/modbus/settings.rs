//! How the line is set.

/// Bits per second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Baud {
    /// 9600.
    B9600,
    /// 19 200, as the protocol has it where nobody says another.
    B19200,
    /// 38 400.
    B38400,
    /// 57 600.
    B57600,
    /// 115 200, as drivers of the Robotiq convention have it.
    #[default]
    B115200,
    /// 230 400.
    B230400,
}

impl Baud {
    /// Every one of them, in the order of their words in the settings file.
    pub const ALL: [Self; 6] = [
        Self::B9600,
        Self::B19200,
        Self::B38400,
        Self::B57600,
        Self::B115200,
        Self::B230400,
    ];

    /// The number.
    pub const fn bits_per_s(self) -> u32 {
        match self {
            Self::B9600 => 9_600,
            Self::B19200 => 19_200,
            Self::B38400 => 38_400,
            Self::B57600 => 57_600,
            Self::B115200 => 115_200,
            Self::B230400 => 230_400,
        }
    }
}

/// How the line is set; always 8 bits, no parity, one stop bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// The slave's id, 1 to 247.
    pub id: u8,
    /// Bits per second.
    pub baud: Baud,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            id: 9,
            baud: Baud::default(),
        }
    }
}
