//! Counts of cases in the orientation by evidence; tests check that all cases occur.

/// Numbers of cases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Weighing {
    /// Step 1: joins of triangles that contradicted earlier ones.
    pub folded: usize,
    /// Step 2: vertices of triangles that give evidence because a scanner saw them.
    pub faced: usize,
    /// Step 3: pairs of patches that candidates voted on, and candidates with more than three triangles.
    pub votes: usize,
    pub crowded: usize,
    /// Step 3: crossing T3 at an edge of a block that only vertices of other blocks flag.
    pub flagged_elsewhere: usize,
    /// Step 4: contracted only because the pair dominates; not contracted because of the number of triangles;
    /// and because evidence for facing up was against it.
    pub dominated: usize,
    pub capped: usize,
    pub against: usize,
    /// Steps 4 and 6: contracted with a sum of 0, and named by the larger number.
    pub zero: usize,
    pub renamed: usize,
    /// Step 5: triangles removed.
    pub cut_inside: usize,
    /// Step 6: crossing triangles with a node of their own.
    pub own_nodes: usize,
    /// Step 6: nodes contracted with the sky, and the number of those that were turned.
    pub under_sky: usize,
    pub turned_by_sky: usize,
    /// Step 6: pairs with the sky that were examined and not contracted.
    pub left_free: usize,
    /// Step 6: parts turned by the second look.
    pub looked_back: usize,
    /// Step 7: crossing triangles removed, and triangles removed at edges between labels.
    pub cut_crossing: usize,
    pub cut_between: usize,
}

impl Weighing {
    /// Counts a contraction.
    pub fn contracted(&mut self, sum: i64, larger_number: bool, sky: bool) {
        self.zero += usize::from(sum == 0);
        self.renamed += usize::from(larger_number && !sky);
        self.under_sky += usize::from(sky);
        self.turned_by_sky += usize::from(sky && sum < 0);
    }

    /// All counts with their names.
    pub fn all(&self) -> [(&'static str, usize); 18] {
        [
            ("folded", self.folded),
            ("faced", self.faced),
            ("votes", self.votes),
            ("crowded", self.crowded),
            ("flagged elsewhere", self.flagged_elsewhere),
            ("dominated", self.dominated),
            ("capped", self.capped),
            ("against", self.against),
            ("zero", self.zero),
            ("renamed", self.renamed),
            ("cut inside", self.cut_inside),
            ("own nodes", self.own_nodes),
            ("under sky", self.under_sky),
            ("turned by sky", self.turned_by_sky),
            ("left free", self.left_free),
            ("looked back", self.looked_back),
            ("cut crossing", self.cut_crossing),
            ("cut between", self.cut_between),
        ]
    }

    /// Adds the counts of another run.
    pub fn add(&mut self, more: &Self) {
        let Self {
            folded,
            faced,
            votes,
            crowded,
            flagged_elsewhere,
            dominated,
            capped,
            against,
            zero,
            renamed,
            cut_inside,
            own_nodes,
            under_sky,
            turned_by_sky,
            left_free,
            looked_back,
            cut_crossing,
            cut_between,
        } = more;
        self.folded += folded;
        self.faced += faced;
        self.votes += votes;
        self.crowded += crowded;
        self.flagged_elsewhere += flagged_elsewhere;
        self.dominated += dominated;
        self.capped += capped;
        self.against += against;
        self.zero += zero;
        self.renamed += renamed;
        self.cut_inside += cut_inside;
        self.own_nodes += own_nodes;
        self.under_sky += under_sky;
        self.turned_by_sky += turned_by_sky;
        self.left_free += left_free;
        self.looked_back += looked_back;
        self.cut_crossing += cut_crossing;
        self.cut_between += cut_between;
    }

    /// The names of cases that never occurred, except the given ones.
    pub fn missing(&self, but: &[&str]) -> Vec<&'static str> {
        let all = self.all().into_iter();
        all.filter(|(name, count)| *count == 0 && !but.contains(name))
            .map(|(name, _)| name)
            .collect()
    }
}
