//! The word that lets a page command.

/// 128 random bits, as hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// A new one, from the system's random numbers.
    pub fn random() -> Self {
        Self(format!("{:032x}", rand::random::<u128>()))
    }

    /// As it is printed.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether this is it. How long that takes does not tell how much of it is right.
    pub fn is(&self, word: &str) -> bool {
        let pairs = self.0.bytes().zip(word.bytes());
        let differences = pairs.fold(0, |all, (a, b)| all | (a ^ b));
        word.len() == self.0.len() && differences == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_no_other_and_no_part_of_itself() {
        let token = Token::random();
        assert_eq!(token.as_str().len(), 32);
        assert!(token.is(token.as_str()));
        assert!(!token.is(&token.as_str()[1..]));
        assert!(!token.is(&format!("{}0", token.as_str())));
        assert!(!token.is(""));
        assert_ne!(token, Token::random());
        let last = if token.as_str().ends_with('0') {
            "1"
        } else {
            "0"
        };
        let near = format!("{}{last}", &token.as_str()[..31]);
        assert!(!token.is(&near));
    }
}
