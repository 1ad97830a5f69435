//! Choices by name: enums whose variants have names, each said once for files, reports, messages and Python.
//!
//! In: an enum with the name of each variant. Out: the enum, all of its variants, their names, and the variant of a name.
//! Never here: the effect of a choice.
//!
//! ```
//! metachron_core::choices! {
//!     /// How a door is.
//!     pub enum Door {
//!         /// Nothing passes.
//!         Shut = "shut",
//!         /// All passes.
//!         WideOpen = "wide-open",
//!     }
//! }
//! assert_eq!("wide-open".parse(), Ok(Door::WideOpen));
//! assert_eq!(Door::ALL.map(Door::name), ["shut", "wide-open"]);
//! let error = "ajar".parse::<Door>().unwrap_err();
//! assert_eq!(error.to_string(), "\"ajar\"; expected one of shut, wide-open");
//! ```

/// Enums without fields, each variant with its name, which files and serde have as well.
#[macro_export]
macro_rules! choices {
    ($($(#[$of_all:meta])* $vis:vis enum $kind:ident { $($(#[$of_one:meta])* $one:ident = $name:tt),+ $(,)? })+) => {$(
        $(#[$of_all])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        $vis enum $kind {
            $($(#[$of_one])* #[serde(rename = $name)] $one),+
        }

        impl $kind {
            /// All of them, in their order.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$one),+];

            /// Its name in files, reports and messages.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$one => $name),+
                }
            }
        }

        impl std::str::FromStr for $kind {
            type Err = $crate::NoSuchChoice;

            fn from_str(name: &str) -> Result<Self, $crate::NoSuchChoice> {
                let found = Self::ALL.into_iter().find(|one| one.name() == name);
                found.ok_or_else(|| $crate::NoSuchChoice { name: name.to_owned(), known: &[$($name),+] })
            }
        }
    )+};
}

/// A name that no variant has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name:?}; expected one of {}", known.join(", "))]
pub struct NoSuchChoice {
    /// The name given.
    pub name: String,
    /// The names that there are.
    pub known: &'static [&'static str],
}
