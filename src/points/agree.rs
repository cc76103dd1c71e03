//! The reference system of all files together, and what of them does not agree.

use super::belong;
use super::crs::Crs;
use super::given::GivenCrs;
use super::stats::IngestStats;
use super::systems::Systems;
use super::units;
use outcrop_disk::error::Setting;
use outcrop_disk::workspace::progress::Observer;

impl IngestStats {
    /// Compares the files with each other; returns the well-known text of the system of all, which is `given` if
    /// that is.
    pub fn compare(
        &mut self,
        systems: Systems,
        given: Option<&GivenCrs>,
        observer: &dyn Observer,
    ) -> Option<String> {
        let (found, warning) = match (systems.common(), given) {
            (common, Some(given)) => {
                let given = given.crs();
                let option = observer.spell(&Setting::Option("crs"));
                let warning = belong::replaced(&self.files, &common, &given, &option);
                (Some(given), warning)
            }
            (Ok(crs), None) => {
                let warning = crs
                    .as_ref()
                    .and_then(|crs| belong::without(&self.files, crs));
                (crs, warning)
            }
            (Err(mixed), None) => (None, Some(self.mixed.insert(mixed).warning())),
        };
        let units = found
            .as_ref()
            .and_then(|crs| units::warning(&self.files, crs, observer));
        let places = belong::warnings(&self.files);
        let warnings = warning.into_iter().chain(units).chain(places);
        self.warnings.extend(warnings);
        self.crs = found.as_ref().map(Crs::without_texts);
        found.and_then(|crs| crs.wkt)
    }
}
