//! Normals that points have in their files: those that were read.

use super::Spool;
use super::carry::Carried;
use super::columns::{normal_columns, row_bytes};
use super::source::Source;

impl Spool {
    /// The names of the columns of the normals, if they were read and a file has any: those of the first such file.
    #[must_use]
    pub fn normal_names(&self) -> Option<[String; 3]> {
        let kept = self.sources.iter().filter(|s| s.stats.kept > 0);
        let names = |source: &Source| {
            let numbers = normal_columns(&source.columns)?;
            Some(numbers.map(|number| source.columns[number].name.clone()))
        };
        let mut all: Vec<_> = kept.filter_map(names).collect();
        all.sort_unstable();
        all.into_iter().next()
    }

    /// The same columns, and the normals of the points if they were read and a file has any.
    #[must_use]
    pub fn with_normals(&self, mut carried: Carried) -> Carried {
        if self.normal_names().is_some() {
            let parts = |source: &Source| {
                let numbers = normal_columns(&source.columns)?;
                let at = |number: usize| row_bytes(&source.columns[..number]);
                Some(numbers.map(|number| (at(number), source.columns[number].scalar)))
            };
            carried.normals = Some(self.sources.iter().map(parts).collect());
        }
        carried
    }
}
