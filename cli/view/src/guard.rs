//! Who may ask the server: a page of its own that knows the token.
//!
//! A page of another origin could send requests to a port of this machine, and a name that it controls could lead there (rebinding of DNS).  So the
//! names by which the server is called are checked (`Host`), the origin where a browser states one, and a random token in every request.

use std::fmt::Write as _;

/// Bytes of a token: nobody guesses 256 bits.
const TOKEN: usize = 32;

/// What requests are checked against.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    token: String,
    hosts: [String; 2],
}

/// What a request says of itself.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Asked<'a> {
    pub(crate) host: Option<&'a str>,
    pub(crate) origin: Option<&'a str>,
    /// What the browser says of where the request comes from (`Sec-Fetch-Site`).
    pub(crate) site: Option<&'a str>,
    pub(crate) token: Option<&'a str>,
}

impl Guard {
    /// For a port of the loopback.
    ///
    /// # Errors
    /// The system gives no random numbers.
    pub(crate) fn new(port: u16) -> Result<Self, String> {
        Ok(Self { token: random()?, hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")] })
    }

    pub(crate) fn token(&self) -> &str {
        &self.token
    }

    /// `Err`: why the request is refused, in words.
    pub(crate) fn admit(&self, asked: &Asked<'_>) -> Result<(), &'static str> {
        let is_own = |name: &str| self.hosts.iter().any(|host| host.eq_ignore_ascii_case(name));
        if !asked.host.is_some_and(is_own) {
            return Err("the name of the host is not that of this server");
        }
        let is_own_origin = |origin: &str| origin.strip_prefix("http://").is_some_and(is_own);
        if asked.origin.is_some_and(|origin| !is_own_origin(origin)) {
            return Err("the request comes from another origin");
        }
        if asked.site.is_some_and(|site| !matches!(site, "same-origin" | "none")) {
            return Err("the request comes from another site");
        }
        if !asked.token.is_some_and(|token| is_equal(token.as_bytes(), self.token.as_bytes())) {
            return Err("the token is not that of this server: open the address that hyd view printed");
        }
        Ok(())
    }
}

/// A token as text.
pub(crate) fn random() -> Result<String, String> {
    let mut bytes = [0_u8; TOKEN];
    getrandom::fill(&mut bytes).map_err(|error| format!("the system gives no random numbers: {error}"))?;
    let mut text = String::new();
    for byte in bytes {
        let _ = write!(text, "{byte:02x}");
    }
    Ok(text)
}

/// Takes as long whatever differs.
fn is_equal(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |all, (x, y)| all | (x ^ y)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_page_of_its_own_with_the_token_is_answered() {
        let guard = Guard { token: "ab12".into(), hosts: ["127.0.0.1:80".into(), "localhost:80".into()] };
        let own = Asked { host: Some("localhost:80"), token: Some("ab12"), ..Asked::default() };
        assert_eq!(guard.admit(&own), Ok(()));
        assert_eq!(
            guard.admit(&Asked { origin: Some("http://127.0.0.1:80"), site: Some("same-origin"), ..own }),
            Ok(())
        );
        let refused = [
            Asked { host: None, ..own },
            Asked { host: Some("evil.example:80"), ..own },
            Asked { host: Some("127.0.0.1:81"), ..own },
            Asked { origin: Some("http://evil.example"), ..own },
            Asked { origin: Some("null"), ..own },
            Asked { origin: Some("https://localhost:80"), ..own },
            Asked { site: Some("cross-site"), ..own },
            Asked { site: Some("same-site"), ..own },
            Asked { token: None, ..own },
            Asked { token: Some("ab13"), ..own },
            Asked { token: Some("ab1"), ..own },
        ];
        for asked in refused {
            assert!(guard.admit(&asked).is_err(), "{asked:?}");
        }
    }

    #[test]
    fn tokens_are_long_and_differ() {
        let (a, b) = (random(), random());
        assert!(a.as_ref().is_ok_and(|own| own.len() == 64) && a != b);
    }
}
