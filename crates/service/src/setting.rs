//! Settings: a section of them as one table, from which its struct, its defaults, its checks and its documents are
//! made.
//!
//! A row has a sentence, a name, a type, a default, a unit, and the least and the largest value where there are any.
//! The list of settings in `docs/guide/operations.md`, the comments of `mrol config print` and its JSON schema are made
//! from the rows; tests say so.

use std::net::SocketAddr;
use std::path::PathBuf;

use mrol_store::{Durability, StoreMode};

/// A setting, as documents tell it.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name in its section.
    pub name: &'static str,
    /// What its value is.
    pub kind: SettingKind,
    /// Unit of the value.
    pub unit: Unit,
    /// Smallest value.
    pub least: Option<f64>,
    /// Largest value.
    pub most: Option<f64>,
    /// Words that are allowed; none where any text is.
    pub words: Vec<&'static str>,
    /// Its meaning.
    pub sentence: String,
}

/// The largest whole number of a setting, which every language reads as what it is: 2^53.
const INTEGER_MAX: f64 = (1u64 << f64::MANTISSA_DIGITS) as f64;

/// What the value of a setting is, in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SettingKind {
    /// `true` or `false`.
    Boolean,
    /// A whole number, not negative.
    Integer,
    /// A number.
    Number,
    /// A text.
    Text,
    /// A list of texts.
    Texts,
    /// Two corners, each of three numbers.
    Corners,
}

/// Unit of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(non_camel_case_types, reason = "rows of a table name them as people write them")]
pub enum Unit {
    /// None: a count, a share, or no number at all.
    none,
    /// Bytes.
    bytes,
    /// Bytes a second.
    bytes_per_s,
    /// 2^20 bytes.
    MiB,
    /// Seconds.
    s,
    /// Meters.
    m,
    /// Degrees.
    deg,
    /// Days.
    days,
}

/// A value that is out of its range.
#[derive(Debug, Clone, PartialEq)]
pub struct OutOfRange {
    /// Section and name of the setting, joined by a dot.
    pub key: &'static str,
    /// The range, as text.
    pub range: String,
    /// The value that was given.
    pub value: String,
}

/// A type that a setting may have.
pub trait SettingValue {
    /// What its values are in a file.
    const KIND: SettingKind;

    /// Words that are allowed; none where any text is.
    fn words() -> Vec<&'static str> {
        Vec::new()
    }

    /// The value where it is a number, and as people write it.
    fn number(&self) -> Option<(f64, String)> {
        None
    }
}

impl Setting {
    /// The values that are allowed, as text; none where all of its kind are.
    pub fn range(&self) -> Option<String> {
        range(self.least, self.most)
    }

    /// The smallest and the largest value, those of its kind where it has none of its own.
    pub fn bounds(&self) -> (Option<f64>, Option<f64>) {
        let of_kind = (self.kind == SettingKind::Integer).then_some((0.0, INTEGER_MAX));
        (self.least.or(of_kind.map(|(least, _)| least)), self.most.or(of_kind.map(|(_, most)| most)))
    }

    /// What is said of a number of this setting, which is called `key`, that is out of range; none of one that is not.
    pub fn out_of_range(&self, key: &'static str, (number, value): (f64, String)) -> Option<OutOfRange> {
        let (least, most) = self.bounds();
        let is_within = least.is_none_or(|least| number >= least) && most.is_none_or(|most| number <= most);
        let range = range(least, most).filter(|_| !is_within)?;
        Some(OutOfRange { key, range, value })
    }
}

fn range(least: Option<f64>, most: Option<f64>) -> Option<String> {
    match (least, most) {
        (Some(least), Some(most)) => Some(format!("{least} to {most}")),
        (Some(least), None) => Some(format!("at least {least}")),
        (None, Some(most)) => Some(format!("at most {most}")),
        (None, None) => None,
    }
}

impl Unit {
    /// Its sign; empty where there is none.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::none => "",
            Self::bytes => "bytes",
            Self::bytes_per_s => "bytes/s",
            Self::MiB => "MiB",
            Self::s => "s",
            Self::m => "m",
            Self::deg => "degrees",
            Self::days => "days",
        }
    }
}

macro_rules! values {
    ($($type:ty, $kind:ident $(, $number:expr)?;)+) => {
        $(impl SettingValue for $type {
            const KIND: SettingKind = SettingKind::$kind;
            $(
                fn number(&self) -> Option<(f64, String)> {
                    let number: fn(Self) -> f64 = $number;
                    Some((number(*self), self.to_string()))
                }
            )?
        })+
    };
}

values! {
    bool, Boolean;
    u32, Integer, f64::from;
    u64, Integer, |number| number as f64;
    usize, Integer, |number| number as f64;
    f64, Number, |number| number;
    String, Text;
    PathBuf, Text;
    SocketAddr, Text;
    Durability, Text;
    StoreMode, Text;
    Vec<String>, Texts;
    [[f64; 3]; 2], Corners;
}

impl<T: SettingValue> SettingValue for Option<T> {
    const KIND: SettingKind = T::KIND;

    fn number(&self) -> Option<(f64, String)> {
        self.as_ref().and_then(T::number)
    }
}

/// Makes a section of the settings from its rows: a sentence, a name, a type, a default, a unit, and the least and the
/// largest value where there are any; attributes for serde come last. Rows under `constants` were settings once: a file
/// that sets one is read, and what it sets does not count.
///
/// ```
/// mrol_service::section! {
///     /// Settings of doors.
///     pub struct Doors in "doors" {
///         /// Doors that may be open at once.
///         open_max: u32 = 4; none, from 1, to 100;
///         /// How long one may be open.
///         open_max_s: f64 = 10.0; s;
///     }
/// }
///
/// assert_eq!(Doors::default().open_max, 4);
/// let refused = Doors { open_max: 0, ..Doors::default() }.out_of_range().unwrap();
/// assert_eq!((refused.key, refused.range.as_str()), ("doors.open_max", "1 to 100"));
/// assert_eq!(Doors::settings()[1].sentence, "How long one may be open.");
/// ```
#[macro_export]
macro_rules! section {
    (
        $(#[$of_struct:meta])*
        $visible:vis struct $section:ident in $path:literal {
            $(
                $(#[doc = $doc:literal])+
                $name:ident: $type:ty = $default:expr;
                $unit:ident $(, from $least:expr)? $(, to $most:expr)? $(, #[$attribute:meta])*;
            )+
        }
        $(constants {
            $(
                $(#[doc = $constant_doc:literal])+
                $constant:ident: $constant_type:ty = $constant_default:expr;
            )+
        })?
    ) => {
        $(#[$of_struct])*
        #[derive(Debug, Clone, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        $visible struct $section {
            $(
                $(#[doc = $doc])+
                #[doc = concat!("\n\nDefault: `", stringify!($default), "`.")]
                $(#[$attribute])*
                pub $name: $type,
            )+
            $($(
                $(#[doc = $constant_doc])+
                #[doc = concat!("\n\nA constant, `", stringify!($constant_default), "`, which is no setting any more.")]
                #[serde(skip_serializing)]
                pub $constant: $constant_type,
            )+)?
        }

        impl Default for $section {
            fn default() -> Self {
                Self { $($name: $default,)+ $($($constant: $constant_default,)+)? }
            }
        }

        impl $section {
            /// The rows of this section, in order.
            pub fn settings() -> Vec<$crate::Setting> {
                vec![$($crate::Setting {
                    name: stringify!($name),
                    kind: <$type as $crate::SettingValue>::KIND,
                    unit: $crate::Unit::$unit,
                    least: [$(f64::from($least))?].first().copied(),
                    most: [$(f64::from($most))?].first().copied(),
                    words: <$type as $crate::SettingValue>::words(),
                    sentence: concat!($($doc),+).trim().to_owned(),
                },)+]
            }

            /// The first value that is out of its range.
            pub fn out_of_range(&self) -> Option<$crate::OutOfRange> {
                let values = [$((
                    concat!($path, ".", stringify!($name)),
                    $crate::SettingValue::number(&self.$name),
                ),)+];
                let mut rows = Self::settings().into_iter().zip(values);
                rows.find_map(|(row, (key, value))| row.out_of_range(key, value?))
            }

            $(
                /// The rows of what was a setting once, each with its value.
                pub fn constants() -> Vec<($crate::Setting, String)> {
                    let constants = Self::default();
                    vec![$((
                        $crate::Setting {
                            name: stringify!($constant),
                            kind: <$constant_type as $crate::SettingValue>::KIND,
                            unit: $crate::Unit::none,
                            least: None,
                            most: None,
                            words: Vec::new(),
                            sentence: concat!($($constant_doc),+).trim().to_owned(),
                        },
                        constants.$constant.to_string(),
                    ),)+]
                }

                /// This section with its constants as they are, and the names of those that were set to something else.
                pub fn with_constants(mut self) -> (Self, Vec<&'static str>) {
                    let constants = Self::default();
                    let mut set = Vec::new();
                    $(if self.$constant != constants.$constant {
                        self.$constant = constants.$constant;
                        set.push(concat!($path, ".", stringify!($constant)));
                    })+
                    (self, set)
                }
            )?
        }
    };
}
