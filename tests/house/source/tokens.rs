//! Source text as tokens, and the paths in it.

/// A path as it is written in some place.
#[derive(Debug, PartialEq)]
pub struct Path {
    /// The inline modules around it: `mod a { mod b { … } }`.
    pub around: Vec<String>,
    pub parts: Vec<String>,
    /// The name that `use` gives to it, in the module around it.
    pub name: Option<String>,
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The length of the comment, the text in quotes or the character with which a text begins; its second value tells if it
/// is a comment.
fn quoted(text: &str) -> Option<(usize, bool)> {
    if text.starts_with("//") {
        return Some((text.find('\n').unwrap_or(text.len()), true));
    }
    let raw = text
        .strip_prefix('r')
        .map(|rest| rest.trim_start_matches('#'));
    if let Some(rest) = raw.filter(|rest| rest.starts_with('"')) {
        let end = format!("\"{}", "#".repeat(text.len() - rest.len() - 1));
        let head = text.len() - rest.len() + 1;
        return Some((head + text[head..].find(&end)? + end.len(), false));
    }
    let quote = text.chars().next().filter(|c| ['"', '\''].contains(c))?;
    let mut inside = text.char_indices().skip(1);
    while let Some((at, c)) = inside.next() {
        match c {
            '\\' => drop(inside.next()),
            c if c == quote => return Some((at + 1, false)),
            // The name of a lifetime.
            _ if quote == '\'' && at > 1 && !text[1..].starts_with('\\') => return None,
            _ => {}
        }
    }
    None
}

/// A text without its comments.
pub fn without_comments(text: &str) -> String {
    let (mut code, mut from) = (String::with_capacity(text.len()), 0);
    let mut word = false;
    while let Some(c) = text[from..].chars().next() {
        let length = match quoted(&text[from..]).filter(|_| !word || c != 'r') {
            Some((length, true)) => {
                from += length;
                continue;
            }
            Some((length, false)) => length,
            None => c.len_utf8(),
        };
        code.push_str(&text[from..from + length]);
        word = is_word(c);
        from += length;
    }
    code
}

/// Words, `::` and all other signs of a text without comments; a text in quotes is one token.
pub fn tokens(text: &str) -> Vec<&str> {
    let (mut all, mut from) = (Vec::new(), 0);
    while let Some(c) = text[from..].chars().next() {
        let rest = &text[from..];
        let length = match quoted(rest) {
            Some((length, _)) => length,
            None if is_word(c) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            None if rest.starts_with("::") => 2,
            None => c.len_utf8(),
        };
        if !c.is_whitespace() {
            all.push(&rest[..length]);
        }
        from += length;
    }
    all
}

/// The paths of one `use`, from behind its word on: `a::{b, c::{self, d as e}}`.
fn of_use(tokens: &[&str], before: &[&str], found: &mut Vec<(Vec<String>, String)>) -> usize {
    let (mut path, mut name, mut at) = (before.to_vec(), None, 0);
    let mut whole = true;
    while at < tokens.len() {
        match tokens[at] {
            "::" => {}
            "as" => {
                name = Some(tokens[at + 1]);
                at += 1;
            }
            "{" => {
                whole = false;
                at += 1;
                while tokens[at] != "}" {
                    at += of_use(&tokens[at..], &path, found);
                    at += usize::from(tokens[at] == ",");
                }
            }
            "," | "}" | ";" => break,
            part => path.push(part),
        }
        at += 1;
    }
    if whole {
        if path.last() == Some(&"self") && path.len() > 1 {
            path.pop();
        }
        let name = name.unwrap_or(path[path.len() - 1]);
        found.push((
            path.into_iter().map(str::to_owned).collect(),
            name.to_owned(),
        ));
    }
    at
}

/// All paths in a text without comments: those of `use`, and those of two or more names.
pub fn paths(text: &str) -> Vec<Path> {
    let tokens = tokens(text);
    let (mut found, mut depth) = (Vec::new(), 0);
    // With the depth of braces in each.
    let mut inline: Vec<(&str, i32)> = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let after = |number: usize| tokens.get(at + number).copied().unwrap_or_default();
        let around = || inline.iter().map(|(name, _)| (*name).to_owned()).collect();
        match tokens[at] {
            "{" => depth += 1,
            "}" => {
                depth -= 1;
                inline.retain(|(_, inside)| *inside <= depth);
            }
            "mod" if after(2) == "{" => inline.push((after(1), depth + 1)),
            "use" if after(1) != "<" => {
                let mut used = Vec::new();
                at += of_use(&tokens[at + 1..], &[], &mut used);
                found.extend(used.into_iter().map(|(parts, name)| Path {
                    around: around(),
                    parts,
                    name: Some(name),
                }));
            }
            word if word.starts_with(is_word) && after(1) == "::" => {
                let mut parts = vec![word.to_owned()];
                while tokens.get(at + 1) == Some(&"::")
                    && tokens
                        .get(at + 2)
                        .is_some_and(|next| next.starts_with(is_word))
                {
                    parts.push(tokens[at + 2].to_owned());
                    at += 2;
                }
                found.push(Path {
                    around: around(),
                    parts,
                    name: None,
                });
            }
            _ => {}
        }
        at += 1;
    }
    found
}
