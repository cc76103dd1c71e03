//! The pages of the commands; a build without pages refuses them before the work.

#[cfg(not(feature = "pages"))]
pub use absent::{change, compare, info, report, verify};
#[cfg(feature = "pages")]
pub use made::{change, compare, info, report, verify};

#[cfg(feature = "pages")]
mod made {
    use super::super::new_file::NewFile;
    use crate::params::Params;
    use crate::pipeline::{ChangeDetection, compare};
    use crate::report::Report;
    use crate::{info, page};
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use outcrop_inspect::{change, verify};
    use std::path::{Path, PathBuf};

    /// The report of a run.
    pub fn report(report: &Report, mesh: &Path) -> Result<String> {
        Ok(page::report(report, mesh))
    }

    /// Describes a cloud.
    pub fn info(
        file: NewFile<'_>,
        inputs: &[PathBuf],
        params: &Params,
        workspace: &Workspace,
    ) -> Result<info::Info> {
        let (info, drawn) = info::illustrated(inputs, params, workspace)?;
        file.write(&page::cloud(inputs, &info, &drawn))?;
        Ok(info)
    }

    /// Checks a mesh.
    pub fn verify(
        file: NewFile<'_>,
        mesh: &Path,
        options: &verify::Options,
        workspace: &Workspace,
    ) -> Result<verify::Verdict> {
        let (verdict, drawn) = verify::illustrated(mesh, options, workspace)?;
        file.write(&page::verdict(mesh, &verdict, &drawn))?;
        Ok(verdict)
    }

    /// Measures the distance between two shapes.
    pub fn compare(
        file: NewFile<'_>,
        [a, b]: [&Path; 2],
        options: &compare::Options,
        workspace: &Workspace,
    ) -> Result<compare::Comparison> {
        let (comparison, drawn) = compare::illustrated(a, b, options, workspace)?;
        file.write(&page::comparison(&comparison, &drawn))?;
        Ok(comparison)
    }

    /// Measures what changed from one surface to another.
    pub fn change(file: NewFile<'_>, job: &ChangeDetection) -> Result<change::Change> {
        job.run_illustrated(|found, drawn| file.write(&page::change(found, drawn)))
    }
}

#[cfg(not(feature = "pages"))]
mod absent {
    use super::super::new_file::NewFile;
    use crate::features::PAGES;
    use crate::info::Info;
    use crate::params::Params;
    use crate::pipeline::ChangeDetection;
    use crate::report::Report;
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use outcrop_inspect::change::Change;
    use outcrop_inspect::compare::{self, Comparison};
    use outcrop_inspect::verify::{self, Verdict};
    use std::path::{Path, PathBuf};

    pub fn report(_: &Report, _: &Path) -> Result<String> {
        Err(PAGES.missing())
    }

    pub fn info(_: NewFile<'_>, _: &[PathBuf], _: &Params, _: &Workspace) -> Result<Info> {
        Err(PAGES.missing())
    }

    pub fn verify(_: NewFile<'_>, _: &Path, _: &verify::Options, _: &Workspace) -> Result<Verdict> {
        Err(PAGES.missing())
    }

    pub fn compare(
        _: NewFile<'_>,
        _: [&Path; 2],
        _: &compare::Options,
        _: &Workspace,
    ) -> Result<Comparison> {
        Err(PAGES.missing())
    }

    pub fn change(_: NewFile<'_>, _: &ChangeDetection) -> Result<Change> {
        Err(PAGES.missing())
    }
}
