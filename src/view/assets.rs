//! The page's own files, which `tools/viewer/build` makes.

/// A file of the page.
#[derive(Debug, Clone, Copy)]
pub struct Asset {
    /// Name in the page's folder.
    pub name: &'static str,
    /// Value of `Content-Type`.
    pub kind: &'static str,
    /// Its bytes.
    pub bytes: &'static [u8],
}

/// The page; its name is empty, as in the URL of a folder.
pub const PAGE: Asset = Asset {
    name: "",
    kind: "text/html; charset=utf-8",
    bytes: include_bytes!("dist/index.html"),
};

/// The program of the page.
pub const SCRIPT: Asset = Asset {
    name: "viewer.js",
    kind: "text/javascript; charset=utf-8",
    bytes: include_bytes!("dist/viewer.js"),
};

/// The look of the page.
pub const STYLE: Asset = Asset {
    name: "viewer.css",
    kind: "text/css; charset=utf-8",
    bytes: include_bytes!("dist/viewer.css"),
};

/// Licences of what the program of the page contains.
pub const LICENCES: Asset = Asset {
    name: "THIRD-PARTY.txt",
    kind: "text/plain; charset=utf-8",
    bytes: include_bytes!("dist/THIRD-PARTY.txt"),
};

/// All files of the page.
pub const ALL: [Asset; 4] = [PAGE, SCRIPT, STYLE, LICENCES];

/// Contents that the page may load, when it comes from the server: its own files, and the decoder of tiles,
/// which is WebAssembly inside the script.
pub const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' \
    'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_names_its_files_and_no_other_host() {
        let page = std::str::from_utf8(PAGE.bytes).unwrap();
        for asset in [SCRIPT, STYLE] {
            assert!(page.contains(asset.name), "{}", asset.name);
        }
        assert!(ALL.iter().all(|asset| asset.bytes.len() > 1000));
        assert!(
            !page.contains("http:") && !page.contains("https:"),
            "{page}"
        );
    }
}
