//! Command line of `outcrop`.
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let r = outcrop::Reconstruction::builder().input(&a[1]).output(&a[2]).memory(a.get(3).map_or(512, |m| m.parse().unwrap()) << 20)
        .build().and_then(|r| r.run());
    match r { Ok(r) => println!("{}", serde_json::to_string_pretty(&r).unwrap()), Err(e) => println!("{e}") }
}
