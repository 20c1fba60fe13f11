//! Cases changed at random: none panics, hangs or is refused without a place; what is called sound is run.
//!
//! A hundred times as many as `RIPRAP_TEST_FAULTS` says. A case has its own seed, its number, which a failure names.

use std::collections::BTreeMap;
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use rand_mt::Mt64;
use riprap::case::{Case, RawCase, read, unsupported};
use riprap::error::{Error, Fault};
use riprap::setup::rock_samples;
use serde_json::{Value, json};

use crate::place::{Place, faults};

/// A check that takes longer hangs [s].
const SLOWEST: f64 = 5.0;
/// Of sound cases so many are run, and no longer than this.
const ONE_RUN_IN: usize = 40;
const LONGEST_RUN: Duration = Duration::from_millis(1500);

/// Case files as they stand, and all words that a case may use as keys.
struct Stock {
    cases: Vec<(PathBuf, String)>,
    keys: Vec<String>,
}

impl Stock {
    fn new() -> Self {
        let (mut cases, mut keys) = (vec![], vec![]);
        let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("cases")];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|e| e == "json") {
                    let text = std::fs::read_to_string(&path).expect("a text");
                    if RawCase::parse(&path, &text).is_ok_and(|raw| raw.value.get("stages").is_some()) {
                        cases.push((path, text));
                    }
                }
            }
        }
        cases.sort();
        assert!(cases.len() > 60, "{} cases", cases.len());
        collect_keys(&riprap::case::schema(), &mut keys);
        keys.sort();
        keys.dedup();
        assert!(keys.len() > 100, "{} keys", keys.len());
        Stock { cases, keys }
    }
}

fn collect_keys(schema: &Value, keys: &mut Vec<String>) {
    match schema {
        Value::Object(map) => {
            if let Some(properties) = map.get("properties").and_then(Value::as_object) {
                keys.extend(properties.keys().cloned());
            }
            map.values().for_each(|value| collect_keys(value, keys));
        }
        Value::Array(items) => items.iter().for_each(|item| collect_keys(item, keys)),
        _ => {}
    }
}

/// Chance for one case.
struct Chance(Mt64);

impl Chance {
    fn below(&mut self, n: usize) -> usize {
        (self.0.next_u64() % n.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

/// Texts that are no number with a unit, or hardly one; that a terminal obeys; that name what is no file to read.
const ODD_TEXTS: [&str; 44] = [
    "",
    " ",
    "5 furlong",
    "1e400 MPa",
    "NaN mm",
    "inf m",
    "-5 MPa",
    "5 MPa MPa",
    "5MPa",
    "1,5 mm",
    "0x10 mm",
    "1e-400 m",
    "- mm",
    "mm",
    "0 %",
    "200 %",
    "90 deg",
    "1 mm^3",
    "30 kg/m3",
    "+1 Pa",
    "1e3",
    "٣ mm",
    "５ mm",
    "µm",
    "3 μm",
    "\u{1b}[31mred",
    "\u{0}",
    "a\u{7}b",
    "\u{9b}2J",
    "\u{7f}",
    "\u{202e}cod",
    "a\nb",
    "a\tb",
    "a/b",
    "..",
    "é̂",
    "=cmd|calc!A0",
    "/dev/zero",
    "/dev/null",
    "/proc/self/mem",
    "../../etc/passwd",
    "nowhere.vtu",
    "<script>",
    "\u{fffe}\u{10ffff}",
];

fn odd_value(chance: &mut Chance) -> Value {
    match chance.below(12) {
        0 => Value::Null,
        1 => json!(chance.below(2) == 0),
        2 => json!(f64::from_bits(chance.0.next_u64())),
        3 => json!(chance.0.next_u64()),
        4 => json!(*chance.of(&[
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            1e-300,
            1e300,
            f64::MAX,
            5e-324,
            9_007_199_254_740_993.0,
            1e9,
            1e-9
        ])),
        5 => json!(-(chance.below(1 << 40) as i64)),
        6 => json!([]),
        7 => json!({}),
        8 => json!("x".repeat(1 << chance.below(14))),
        9 => (0..1 << chance.below(9))
            .fold(json!(1), |inner, k| if k % 2 == 0 { json!([inner]) } else { json!({"a": inner}) }),
        _ => json!(*chance.of(&ODD_TEXTS)),
    }
}

/// Places of a tree, depth first.
fn count(tree: &Value) -> usize {
    1 + match tree {
        Value::Array(items) => items.iter().map(count).sum(),
        Value::Object(map) => map.values().map(count).sum::<usize>(),
        _ => 0,
    }
}

fn nth<'a>(tree: &'a mut Value, at: &mut usize) -> Option<&'a mut Value> {
    if *at == 0 {
        return Some(tree);
    }
    *at -= 1;
    match tree {
        Value::Array(items) => items.iter_mut().find_map(|item| nth(item, at)),
        Value::Object(map) => map.values_mut().find_map(|item| nth(item, at)),
        _ => None,
    }
}

/// Some place of a tree.
fn some<'a>(tree: &'a mut Value, chance: &mut Chance) -> &'a mut Value {
    let mut at = chance.below(count(tree));
    nth(tree, &mut at).expect("a place that was counted")
}

/// Changes a tree in one way.
fn change_tree(tree: &mut Value, stock: &Stock, chance: &mut Chance) {
    let (way, other) = (chance.below(10), chance.below(stock.cases.len()));
    match way {
        // A block of another case, or of this one, in the place of another.
        0 | 1 => {
            let mut from = match way {
                0 => serde_json::from_str(&stock.cases[other].1).unwrap_or(Value::Null),
                _ => tree.clone(),
            };
            *some(tree, chance) = some(&mut from, chance).take();
        }
        2 | 3 => {
            let odd = odd_value(chance);
            *some(tree, chance) = odd;
        }
        _ => change_place(some(tree, chance), way, stock, chance),
    }
}

fn change_place(place: &mut Value, way: usize, stock: &Stock, chance: &mut Chance) {
    match place {
        Value::Object(map) => {
            let old = map.keys().nth(chance.below(map.len())).cloned().unwrap_or_default();
            match way {
                4 | 5 => {
                    map.insert(chance.of(&stock.keys).clone(), odd_value(chance));
                }
                6 => {
                    let new = match chance.below(4) {
                        0 => chance.of(&stock.keys).clone(),
                        1 => chance.of(&ODD_TEXTS).to_string(),
                        2 => old.chars().rev().collect(),
                        _ => format!("{old}s"),
                    };
                    let value = map.shift_remove(&old).unwrap_or_default();
                    map.insert(new, value);
                }
                _ => {
                    map.shift_remove(&old);
                }
            }
        }
        Value::Array(items) if !items.is_empty() => {
            let at = chance.below(items.len());
            let item = items[at].clone();
            match way {
                4 => items.extend(vec![item; 1 << chance.below(10)]),
                5 => items.insert(at, item),
                6 => items.reverse(),
                _ => {
                    items.remove(at);
                }
            }
        }
        Value::Number(number) => {
            let factors = [-1.0, 0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.9, 1.1, 2.0, 10.0, 1e3, 1e6, 1e12];
            *place = json!(number.as_f64().unwrap_or(0.0) * chance.of(&factors));
        }
        Value::String(text) => {
            let at = chance.below(text.chars().count() + 1);
            let at = text.char_indices().nth(at).map_or(text.len(), |(at, _)| at);
            let more = *chance.of(&ODD_TEXTS);
            text.insert_str(at, more);
        }
        place => *place = odd_value(chance),
    }
}

/// Changes a text in one way; not each is one any more.
fn change_text(text: &mut Vec<u8>, chance: &mut Chance) {
    let tokens: [&[u8]; 16] = [
        b"NaN",
        b"Infinity",
        b"1e999",
        b"-",
        b"0x10",
        b"/*",
        b"//",
        b"\"",
        b"{",
        b"]",
        b",",
        b"\"seed\": 1, \"seed\": 2,",
        b"\\u0000",
        b"\\ud800",
        b"\xff\xfe",
        b"\x1b[2J",
    ];
    let (a, b) = (chance.below(text.len() + 1), chance.below(text.len() + 1));
    let near = (a + chance.below(9)).min(text.len());
    match chance.below(6) {
        0 => text.truncate(a),
        1 => drop(text.drain(a..near)),
        2 => drop(text.splice(a..near, chance.of(&tokens).iter().copied())),
        3 => drop(text.splice(a..a, chance.of(&tokens).repeat(1 << chance.below(13)))),
        4 => {
            let block = text[a.min(b)..a.max(b)].to_vec();
            let at = chance.below(text.len() + 1);
            drop(text.splice(at..at, block));
        }
        _ => {
            for at in a..near {
                text[at] = chance.0.next_u64() as u8;
            }
        }
    }
}

/// Case `t`: a file of the stock, changed once to three times, and where it lies.
fn mutated(t: usize, stock: &Stock) -> (&Path, Vec<u8>) {
    let mut chance = Chance(Mt64::new(t as u64));
    let (path, text) = &stock.cases[t % stock.cases.len()];
    let changes = *chance.of(&[1, 1, 1, 2, 2, 3]);
    let mut bytes = text.clone().into_bytes();
    if chance.below(4) > 0 {
        let mut tree = RawCase::parse(path, text).expect("a case").value;
        (0..changes).for_each(|_| change_tree(&mut tree, stock, &mut chance));
        bytes = format!("{tree:#}").into_bytes();
    } else {
        (0..changes).for_each(|_| change_text(&mut bytes, &mut chance));
    }
    (path, bytes)
}

/// Whether the value of a path, or what it would lie in, is there.
fn is_placed(root: &Value, path: &str) -> bool {
    let Some(mut rest) = path.strip_prefix('$') else { return false };
    let mut found = Some(root);
    while !rest.is_empty() {
        let Some(inside) = found else { return false };
        let (key, after) = if let Some(quoted) = rest.strip_prefix("[\"") {
            let mut texts = serde_json::Deserializer::from_str(&rest[1..]).into_iter::<String>();
            let Some(Ok(key)) = texts.next() else { return false };
            let after = &rest[1 + texts.byte_offset()..];
            assert!(quoted.len() > after.len());
            (key, after.strip_prefix(']'))
        } else if let Some(index) = rest.strip_prefix('[') {
            let Some((index, after)) = index.split_once(']') else { return false };
            (index.to_string(), Some(after))
        } else {
            let Some(key) = rest.strip_prefix('.') else { return false };
            let end = key.find(['.', '[']).unwrap_or(key.len());
            (key[..end].to_string(), Some(&key[end..]))
        };
        let Some(after) = after else { return false };
        found = match inside {
            Value::Array(items) => key.parse().ok().and_then(|index: usize| items.get(index)),
            other => other.get(&key),
        };
        rest = after;
    }
    true
}

/// What is wrong with how faults are told.
fn ill_told(value: &Value, faults: &[Fault]) -> Option<String> {
    if faults.is_empty() {
        return Some("refused without a fault".into());
    }
    faults.iter().find_map(|fault| {
        let said = fault.to_string();
        let wrong = if said.contains("please report") {
            "not foreseen"
        } else if said.contains(is_obeyed) {
            "a terminal obeys it"
        } else if said.chars().count() > 5000 {
            "endless"
        } else if !is_placed(value, &fault.path) {
            "no such place"
        } else {
            return None;
        };
        Some(format!("{wrong}: {}", said.chars().take(400).collect::<String>()))
    })
}

/// Characters that no message has: a fault is one line.
fn is_obeyed(c: char) -> bool {
    c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// How a case ends that was read and checked as `riprap check` does.
enum Checked {
    NotJson,
    Faulty,
    NotYet,
    Sound(Box<Case>),
}

fn check(path: &Path, file: &Path, bytes: &[u8]) -> Result<Checked, String> {
    let raw = match std::str::from_utf8(bytes) {
        Ok(text) => RawCase::parse(path, text),
        Err(_) => {
            std::fs::write(file, bytes).expect("written");
            read(file)
        }
    };
    let raw = match raw {
        Ok(raw) => raw,
        Err(Error::Json { line, column, message, .. }) => {
            let text = String::from_utf8_lossy(bytes);
            let length = text.split('\n').nth(line.wrapping_sub(1)).map(|line| line.chars().count());
            let is_there = length.is_some_and(|length| (1..=length + 1).contains(&column));
            let plain = !message.contains(is_obeyed) && message.len() < 1000;
            return match is_there && plain {
                true => Ok(Checked::NotJson),
                false => Err(format!("{line}:{column} of {length:?}: {message:?}")),
            };
        }
        Err(other) => return Err(format!("neither JSON nor not: {other}")),
    };
    match raw.check() {
        Ok(case) => {
            let told = [
                case.remarks(),
                case.burdens(Some(1e10)),
                case.remarks_on_meshes(path.parent().unwrap_or(path)),
            ]
            .concat();
            let estimate = case.estimate();
            if !(estimate.memory.is_finite() && estimate.time.is_finite()) {
                return Err(format!("estimated: {estimate}"));
            }
            if let Some(remark) = told.iter().find(|remark| remark.contains(is_obeyed)) {
                return Err(format!("a terminal obeys it: {remark:?}"));
            }
            // Values are drawn by `check`, too.
            rock_samples::expected(&case).map_err(|e| format!("sound, but its rock is not: {e}"))?;
            let text = case.completed().to_string();
            let again = RawCase::parse(path, &text).and_then(|raw| raw.check());
            let again = again.map_err(|e| format!("sound, and completed not: {e}"))?;
            if again != (Case { notes: again.notes.clone(), brought: again.brought.clone(), ..case.clone() })
            {
                return Err("another case, once completed".into());
            }
            let faults = unsupported(&case);
            match faults.is_empty() {
                true => Ok(Checked::Sound(Box::new(case))),
                false => ill_told(&raw.value, &faults).map_or(Ok(Checked::NotYet), Err),
            }
        }
        Err(Error::Case { faults, .. }) => ill_told(&raw.value, &faults).map_or(Ok(Checked::Faulty), Err),
        Err(other) => Err(format!("neither sound nor faulty: {other}")),
    }
}

/// Puts what a case names, files and folders beside it, into another folder.
fn copied(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("the folder").flatten() {
        let (path, to) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copied(&path, &to);
        } else if path.extension().is_none_or(|e| e != "json") {
            std::fs::copy(path, to).expect("a copy");
        }
    }
}

/// Runs a sound case for a while. What is wrong with how that ends, if it ends.
fn refused(place: &Place, path: &Path, bytes: &[u8]) -> Result<&'static str, String> {
    copied(path.parent().unwrap_or(path), &place.path(""));
    std::fs::write(place.path("sound.json"), bytes).expect("written");
    let mut running = place
        .command(&["run", "sound.json", "--out", "sound.h5", "--force", "--quiet", "--threads", "1"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("riprap starts");
    let begun = Instant::now();
    while begun.elapsed() < LONGEST_RUN {
        if running.try_wait().expect("its state").is_some() {
            let ended = running.wait_with_output().expect("its end");
            let said = String::from_utf8_lossy(&ended.stderr).trim().to_string();
            return match ended.status.code() {
                Some(0) => Ok("finished"),
                Some(3) => Ok("stopped"),
                // What a compaction reaches is known once it is done.
                Some(2) if said.contains("cannot be reached with this grading") => Ok("no such packing"),
                code => Err(format!("sound, and ended with {code:?}: {said}")),
            };
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    running.kill().expect("a signal");
    running.wait().expect("its end");
    Ok("still going")
}

#[test]
fn mutated_cases_are_sound_or_refused_with_a_place() {
    let numbers = 100 * faults().start..100 * faults().end;
    let (results, told) = channel();
    let checked = numbers.clone();
    // On a stack as large as the program's own.
    let worker = std::thread::Builder::new().stack_size(8 << 20).spawn(move || {
        let (stock, place) = (Stock::new(), Place::new());
        let mut sound = 0;
        for t in checked {
            let (path, bytes) = mutated(t, &stock);
            let begun = Instant::now();
            let done =
                std::panic::catch_unwind(AssertUnwindSafe(|| check(path, &place.path("x.json"), &bytes)));
            let took = begun.elapsed().as_secs_f64();
            let end = match done {
                Err(_) => Err("a panic".to_string()),
                Ok(Err(wrong)) => Err(wrong),
                Ok(Ok(_)) if took > SLOWEST => Err(format!("{took:.1} s")),
                Ok(Ok(Checked::NotJson)) => Ok(("not JSON", None)),
                Ok(Ok(Checked::Faulty)) => Ok(("faulty", None)),
                Ok(Ok(Checked::NotYet)) => Ok(("not yet possible", None)),
                Ok(Ok(Checked::Sound(case))) => {
                    let small = case.estimate().memory < 5e8 && case.start_from.is_none();
                    sound += usize::from(small);
                    let run = (small && sound % ONE_RUN_IN == 1).then(|| refused(&place, path, &bytes));
                    run.transpose().map(|run| ("sound", run))
                }
            };
            let of = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if results.send((t, of, took, end)).is_err() {
                return;
            }
        }
    });
    let worker = worker.expect("a thread");
    let (mut ends, mut slowest, mut wrong) = (BTreeMap::new(), (0.0, 0), vec![]);
    for t in numbers.clone() {
        match told.recv_timeout(Duration::from_secs(60)) {
            Ok((t, of, took, end)) => {
                slowest = if took > slowest.0 { (took, t) } else { slowest };
                match end {
                    Ok((end, run)) => {
                        *ends.entry((end, "")).or_insert(0) += 1;
                        if let Some(run) = run {
                            *ends.entry(("run", run)).or_insert(0) += 1;
                        }
                    }
                    Err(what) => wrong.push(format!("case {t} (of {of}): {what}")),
                }
            }
            Err(RecvTimeoutError::Timeout) => panic!("case {t} hangs"),
            Err(RecvTimeoutError::Disconnected) => panic!("case {t} ends the thread"),
        }
    }
    worker.join().expect("its end");
    println!("mutated cases {numbers:?}: {ends:?}; slowest {:.2} s (case {})", slowest.0, slowest.1);
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    let of = |end: &str| ends.get(&(end, "")).copied().unwrap_or(0);
    for end in ["not JSON", "faulty", "sound"] {
        assert!(of(end) > numbers.len() / 50, "{ends:?}");
    }
}

#[test]
fn a_place_is_told_from_none() {
    let value = json!({"a": {"b.c": [{"d": 1}], "e\u{1b}": 2}});
    for path in [
        "$",
        "$.a",
        "$.a[\"b.c\"]",
        "$.a[\"b.c\"][0].d",
        "$.a[\"b.c\"][0].gone",
        "$.a[\"e\\u001b\"]",
        "$.gone",
    ] {
        assert!(is_placed(&value, path), "{path}");
    }
    for path in ["", "a", "$.gone.d", "$.a[\"b.c\"][1].d", "$.a[\"b.c", "$[\"e\u{1b}\"].x"] {
        assert!(!is_placed(&value, path), "{path}");
    }
}
