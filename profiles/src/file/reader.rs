//! Typed access to a TOML document that remembers where everything stands.
