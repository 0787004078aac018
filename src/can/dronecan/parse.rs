//! One file of DSDL, line by line.

use std::sync::Arc;

use super::dsdl::{Array, Cast, Compound, CompoundBody, DsdlField, NumberKind, Primitive, Structure, Type};

/// Greatest length of a message [bit]: a kilobyte, several times what anything on a bench sends.
const MOST_BITS: usize = 8 * 1024;
/// Most items of an array, so that no count overflows.
const MOST_ITEMS: usize = 4096;
/// Most lines that say something.
const MOST_LINES: usize = 1000;

/// A definition before it is understood.
pub(super) struct DsdlSource<'a> {
    /// Name of the type, its namespace included.
    pub name: &'a str,
    /// Data type id, from the name of the file.
    pub id: Option<u16>,
    /// The file's text.
    pub text: &'a str,
}

/// Why a definition is refused, and in which line, from 1.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Refused {
    pub line: usize,
    pub reason: String,
}

/// What a line without comment and blanks says.
enum Line<'a> {
    Response,
    Union,
    Signature(u64),
    Field { cast: Cast, of: &'a str, name: &'a str },
    Constant { cast: Cast, of: &'a str, name: &'a str },
}

/// Understands a definition; `find` gives the types it names.
pub(super) fn parse(
    source: &DsdlSource<'_>,
    find: &mut dyn FnMut(&str) -> Result<Arc<Compound>, String>,
) -> Result<Compound, Refused> {
    let mut parts = vec![Structure::default()];
    let mut names: Vec<&str> = Vec::new();
    let mut overridden = None;
    let lines = source.text.lines().enumerate();
    let lines = lines.map(|(index, line)| (index + 1, line.split('#').next().unwrap_or("").trim()));
    for (count, (line, text)) in lines.filter(|(_, text)| !text.is_empty()).enumerate() {
        let fail = |reason: String| Refused { line, reason };
        if count == MOST_LINES {
            return Err(fail(format!("a definition has at most {MOST_LINES} lines")));
        }
        let is_response = parts.len() > 1;
        let Some(part) = parts.last_mut() else { continue };
        match read_line(text).map_err(fail)? {
            Line::Response if is_response => return Err(fail("a second `---`".to_owned())),
            Line::Response => {
                parts.push(Structure::default());
                names.clear();
            }
            Line::Union if part.is_union => return Err(fail("a second `@union`".to_owned())),
            Line::Union => part.is_union = true,
            Line::Signature(signature) => overridden = Some(signature),
            Line::Field { cast, of, name } => {
                remember(&mut names, name).map_err(fail)?;
                let of = read_type(source.name, of, cast, find).map_err(fail)?;
                part.fields.push(DsdlField { name: name.to_owned(), of });
                if part.most_bits() > MOST_BITS {
                    return Err(fail(format!("more than {} bytes", MOST_BITS / 8)));
                }
            }
            Line::Constant { cast, of, name } => {
                remember(&mut names, name).map_err(fail)?;
                read_type(source.name, of, cast, find).map_err(fail)?;
            }
        }
    }
    let body = body(parts, source.id).map_err(|reason| Refused { line: 1, reason })?;
    let signature = Compound::signature_of(source.name, &body, overridden);
    Ok(Compound { name: source.name.to_owned(), id: source.id, body, signature })
}

/// What the structures of a definition are: one a message, two a service.
fn body(mut parts: Vec<Structure>, id: Option<u16>) -> Result<CompoundBody, String> {
    for part in &parts {
        let has_void = part.fields.iter().any(|field| field.name.is_empty());
        if part.is_union && (part.fields.len() < 2 || has_void) {
            return Err("a union has two fields or more, each with a name".to_owned());
        }
    }
    let last = parts.pop().unwrap_or_default();
    let Some(request) = parts.pop() else { return Ok(CompoundBody::Message(last)) };
    if id.is_some_and(|id| id > 0xFF) {
        return Err("the id of a service is at most 255".to_owned());
    }
    Ok(CompoundBody::Service(request, last))
}

fn remember<'a>(names: &mut Vec<&'a str>, name: &'a str) -> Result<(), String> {
    if !name.is_empty() && names.contains(&name) {
        return Err(format!("two fields or constants have the name `{name}`"));
    }
    names.push(name);
    Ok(())
}

fn read_line(text: &str) -> Result<Line<'_>, String> {
    let mut words = text.split_whitespace().peekable();
    let cast = match words.peek() {
        Some(&"truncated") => Some(Cast::Truncated),
        Some(&"saturated") => Some(Cast::Saturated),
        _ => None,
    };
    if cast.is_some() {
        words.next();
    }
    let cast = cast.unwrap_or(Cast::Saturated);
    let (first, second, third) = (words.next().unwrap_or(""), words.next(), words.next());
    let is_void = first.starts_with("void");
    match (first, second, third) {
        ("---", None, _) => Ok(Line::Response),
        ("@union", None, _) => Ok(Line::Union),
        ("OVERRIDE_SIGNATURE", Some(hexadecimal), None) => {
            let digits = hexadecimal.trim_start_matches("0x");
            let signature = u64::from_str_radix(digits, 16).ok();
            Ok(Line::Signature(signature.ok_or("the signature is not a hexadecimal number of 64 bits")?))
        }
        (of, None, _) if is_void => Ok(Line::Field { cast, of, name: "" }),
        (_, Some(_), _) if is_void => Err("bits without meaning have no name".to_owned()),
        (of, Some(name), None) if is_name(name) => Ok(Line::Field { cast, of, name }),
        (of, Some(name), Some("=")) if is_name(name) && words.next().is_some() => {
            Ok(Line::Constant { cast, of, name })
        }
        _ => Err("neither a field (`TYPE NAME`) nor a constant (`TYPE NAME = VALUE`)".to_owned()),
    }
}

fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|first| first.is_ascii_alphabetic())
        && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
}

fn read_type(
    of: &str,
    text: &str,
    cast: Cast,
    find: &mut dyn FnMut(&str) -> Result<Arc<Compound>, String>,
) -> Result<Type, String> {
    let Some((item, size)) = text.strip_suffix(']').and_then(|text| text.split_once('[')) else {
        return match read_number(text, cast)? {
            Some(number) => Ok(number),
            None => {
                let (namespace, _) = of.rsplit_once('.').unwrap_or((of, ""));
                let name = if text.contains('.') { text.to_owned() } else { format!("{namespace}.{text}") };
                let found = find(&name)?;
                found.message().ok_or_else(|| format!("`{name}` is a service, and no part of a message"))?;
                Ok(Type::Compound(found))
            }
        };
    };
    let (digits, below) = match (size.strip_prefix("<="), size.strip_prefix('<')) {
        (Some(digits), _) => (digits, 0),
        (None, Some(digits)) => (digits, 1),
        (None, None) => (size, 0),
    };
    let most = digits.parse::<usize>().ok().and_then(|most| most.checked_sub(below));
    let most = most
        .filter(|most| (1..=MOST_ITEMS).contains(most))
        .ok_or_else(|| format!("`{text}` is no array of 1 to {MOST_ITEMS} items"))?;
    let item = read_type(of, item, cast, find)?;
    if matches!(item, Type::Array(_) | Type::Void(_)) {
        return Err(format!("`{text}` is an array of arrays or of nothing"));
    }
    Ok(Type::Array(Box::new(Array { item, most, is_dynamic: digits.len() < size.len() })))
}

/// A number or bits without meaning; `None` when it is neither by name.
fn read_number(text: &str, cast: Cast) -> Result<Option<Type>, String> {
    let primitive = |kind, bits| Ok(Some(Type::Primitive(Primitive { kind, bits, cast })));
    if text == "bool" {
        return primitive(NumberKind::Boolean, 1);
    }
    let known = ["uint", "int", "float", "void"].into_iter();
    let mut read = known.filter_map(|name| Some((name, text.strip_prefix(name)?.parse::<u32>().ok()?)));
    match read.next() {
        Some(("uint", bits @ 1..=64)) => primitive(NumberKind::Unsigned, bits),
        Some(("int", bits @ 2..=64)) => primitive(NumberKind::Signed, bits),
        Some(("float", bits @ (16 | 32 | 64))) => primitive(NumberKind::Float, bits),
        Some(("void", bits @ 1..=64)) => Ok(Some(Type::Void(bits))),
        Some(_) => Err(format!("there is no `{text}`")),
        None => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_text(text: &str) -> Result<Compound, Refused> {
        let mut find = |name: &str| match name {
            "own.Other" => parse(&DsdlSource { name: "own.Other", id: None, text: "uint8 a" }, &mut |_| {
                Err("no".to_owned())
            })
            .map(Arc::new)
            .map_err(|refused| refused.reason),
            _ => Err(format!("no file defines `{name}`")),
        };
        parse(&DsdlSource { name: "own.Type", id: Some(20_000), text }, &mut find)
    }

    #[test]
    fn what_is_no_definition_is_refused_with_its_line() {
        for (text, line, words) in [
            ("uint8 a\nuint8 a", 2, "the name `a`"),
            ("uint65 a", 1, "no `uint65`"),
            ("int1 a", 1, "no `int1`"),
            ("float24 a", 1, "no `float24`"),
            ("void8 a", 1, "have no name"),
            ("\n# only a comment\nuint8", 3, "neither a field"),
            ("uint8 9a", 1, "neither a field"),
            ("uint8[0] a", 1, "no array of 1 to"),
            ("uint8[<1] a", 1, "no array of 1 to"),
            ("uint8[5000] a", 1, "no array of 1 to"),
            ("uint8[2][3] a", 1, "no array of 1 to"),
            ("uint64[200] a", 1, "more than 1024 bytes"),
            ("Missing a", 1, "no file defines `own.Missing`"),
            ("uint8 A =", 1, "neither a field"),
            ("@union\nuint8 a", 1, "two fields or more"),
            ("@union\nuint8 a\nvoid3", 1, "two fields or more"),
            ("---\n---", 2, "a second `---`"),
            ("uint8 a\n---\nuint8 b", 1, "at most 255"),
            ("OVERRIDE_SIGNATURE 0x12345678901234567", 1, "64 bits"),
        ] {
            let refused = parse_text(text).expect_err(text);
            assert!(refused.line == line && refused.reason.contains(words), "{text:?}: {refused:?}");
        }
    }

    #[test]
    fn fields_constants_and_types_of_the_same_namespace() {
        let text = "truncated uint7[<=9] list # what\nuint8 ONE = 1\nOther other\nvoid3\nbool[2] flags";
        let compound = parse_text(text).expect("sound");
        let fields: Vec<String> = match &compound.body {
            CompoundBody::Message(structure) => structure.fields.iter().map(ToString::to_string).collect(),
            CompoundBody::Service(..) => Vec::new(),
        };
        let expected = ["truncated uint7[<=9] list", "own.Other other", "void3", "saturated bool[2] flags"];
        assert_eq!(fields, expected);
        assert_eq!(compound.message().map(|it| (it.least_bits(), it.most_bits())), Some((13, 80)));
    }
}
