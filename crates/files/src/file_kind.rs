//! Kinds of files, by extension.

use std::path::Path;

/// What a file holds, and of which program it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FileKind {
    /// A point cloud of the Polygon File Format.
    Ply,
    /// A point cloud of PCL.
    Pcd,
    /// A binary octree of OctoMap: occupied and free cells.
    Bt,
    /// A full octree of OctoMap: a probability for each cell.
    Ot,
    /// Arrays of numpy.
    Npz,
    /// A survey of the ASPRS.
    Las,
    /// A compressed survey of the ASPRS.
    Laz,
    /// Scans of a survey of the ASTM.
    E57,
    /// A log, which viewers of logs show: written only, since logs have commands of their own.
    Mcap,
}

impl FileKind {
    /// All kinds, in the order in which messages name them.
    pub const ALL: [Self; 9] =
        [Self::Ply, Self::Pcd, Self::Bt, Self::Ot, Self::Npz, Self::Las, Self::Laz, Self::E57, Self::Mcap];

    /// The kind of the file at `path`, by its extension in either case; none of another extension.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        Self::ALL.into_iter().find(|kind| kind.extension().eq_ignore_ascii_case(extension))
    }

    /// The extension, without its dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Pcd => "pcd",
            Self::Bt => "bt",
            Self::Ot => "ot",
            Self::Npz => "npz",
            Self::Las => "las",
            Self::Laz => "laz",
            Self::E57 => "e57",
            Self::Mcap => "mcap",
        }
    }

    /// All extensions with their dots, as messages name them.
    pub fn extensions() -> String {
        Self::ALL.map(|kind| format!(".{}", kind.extension())).join(" ")
    }

    /// Checks that this program was built with what reads and writes such files.
    ///
    /// # Errors
    /// Names the feature that is lacking, and what to do.
    pub fn checked(self) -> Result<Self, LackingFeature> {
        let (feature, is_built) = match self {
            Self::Las | Self::Laz | Self::E57 => ("surveys", cfg!(feature = "surveys")),
            Self::Mcap => ("recordings", cfg!(feature = "recordings")),
            _ => return Ok(self),
        };
        let extension = self.extension();
        if is_built { Ok(self) } else { Err(LackingFeature { extension, feature }) }
    }
}

/// A kind of file that this program was built without.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    ".{extension} files take a program that was built with the feature `{feature}`, as the released ones are: in a \
     checkout, `cargo install --path . --features released`"
)]
pub struct LackingFeature {
    pub(crate) extension: &'static str,
    pub(crate) feature: &'static str,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_says_the_kind_in_either_case() {
        assert_eq!(FileKind::of(Path::new("a/b.BT")), Some(FileKind::Bt));
        assert_eq!(FileKind::of(Path::new("a/b.tar.e57")), Some(FileKind::E57));
        for none in ["bt", "a/b", "a.bt/b", "a.obj"] {
            assert_eq!(FileKind::of(Path::new(none)), None, "{none}");
        }
    }

    #[test]
    fn a_kind_that_is_not_built_says_what_is_lacking() {
        assert_eq!(FileKind::Bt.checked(), Ok(FileKind::Bt));
        for (kind, is_built, told) in [
            (
                FileKind::Las,
                cfg!(feature = "surveys"),
                ".las files take a program that was built with the feature `surveys`",
            ),
            (FileKind::Mcap, cfg!(feature = "recordings"), ".mcap files take"),
        ] {
            match kind.checked() {
                Ok(_) => assert!(is_built, "{kind:?}"),
                Err(lacking) => assert!(!is_built && lacking.to_string().starts_with(told), "{lacking}"),
            }
        }
    }
}
