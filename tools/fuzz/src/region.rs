//! Regions as text.

use outcrop::Region;

/// Reads a region, and asks it about some points and boxes.
pub fn read(bytes: &[u8]) {
    let Ok(region) = String::from_utf8_lossy(bytes).parse::<Region>() else {
        return;
    };
    assert_eq!(region.check(), Ok(()));
    let area = region.area();
    let [min, max] = region.bounds();
    let middle = [0, 1].map(|k| (min[k] + max[k]) / 2.0);
    for [x, y] in [min, max, middle, [0.0, 0.0], [f64::MAX, -1.0]] {
        let p = [x, y, 0.5];
        assert!(!area.contains(p) || area.is_near(p, 0.0) && area.may_meet([p, p], 0.0));
        assert!(!area.is_near(p, 1.0) || area.may_meet([p, p], 1.0));
    }
    assert!(region.to_string().len() < 400);
}
