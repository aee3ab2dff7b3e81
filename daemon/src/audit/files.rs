//! The files of the trail: the newest is written, and when it is full, the oldest makes room.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What their names begin and end with; between them stands their number, which rises.
const PREFIX: &str = "audit-";
const SUFFIX: &str = ".jsonl";

/// Files of bounded number and size in a directory.
#[derive(Debug)]
pub struct Files {
    directory: PathBuf,
    largest: u64,
    most: usize,
    current: Option<Current>,
}

#[derive(Debug)]
struct Current {
    file: File,
    size: u64,
    /// Whether it has lines that may not be on the disk.
    is_dirty: bool,
}

impl Files {
    /// Files of at most `largest` bytes, of which the `most` newest are kept, in `directory`, which is made if it is
    /// missing. A run begins a file of its own.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn open(directory: &Path, largest: u64, most: usize) -> io::Result<Self> {
        fs::create_dir_all(directory)?;
        let mut files = Self { directory: directory.to_owned(), largest, most, current: None };
        files.begin()?;
        Ok(files)
    }

    /// Adds a line, without its end.
    ///
    /// # Errors
    /// What the operating system says; then a new file is begun with the next line.
    pub fn append(&mut self, line: &str) -> io::Result<()> {
        let length = line.len() as u64 + 1;
        let is_full = self
            .current
            .as_ref()
            .is_none_or(|current| current.size > 0 && current.size + length > self.largest);
        if is_full {
            self.begin()?;
        }
        let Some(current) = &mut self.current else { return Ok(()) };
        let outcome = current.file.write_all(format!("{line}\n").as_bytes());
        current.size += length;
        current.is_dirty = true;
        if outcome.is_err() {
            // What there is of the line stays; the next one is not put behind it.
            self.current = None;
        }
        outcome
    }

    /// Makes sure that everything is on the disk.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn sync(&mut self) -> io::Result<()> {
        match &mut self.current {
            Some(current) if current.is_dirty => {
                current.is_dirty = false;
                current.file.sync_data()
            }
            Some(_) | None => Ok(()),
        }
    }

    /// Begins a file; the oldest make room for it.
    fn begin(&mut self) -> io::Result<()> {
        self.sync()?;
        self.current = None;
        let mut known = numbers(&self.directory)?;
        // An empty file of the last run would be in nobody's way, but a place in the row.
        let next = known.last().map_or(1, |last| last + 1);
        while known.len() >= self.most {
            let oldest = known.remove(0);
            fs::remove_file(path(&self.directory, oldest))?;
        }
        let file = File::options().create_new(true).append(true).open(path(&self.directory, next))?;
        self.current = Some(Current { file, size: 0, is_dirty: false });
        Ok(())
    }
}

/// The last lines of the files in `directory`, at most so many, the oldest first.
///
/// # Errors
/// What the operating system says.
pub fn last_lines(directory: &Path, count: usize) -> io::Result<Vec<String>> {
    let mut lines = Vec::new();
    for number in numbers(directory)?.into_iter().rev() {
        if lines.len() >= count {
            break;
        }
        let text = fs::read_to_string(path(directory, number))?;
        lines.extend(text.lines().rev().take(count - lines.len()).map(str::to_owned));
    }
    lines.reverse();
    Ok(lines)
}

fn path(directory: &Path, number: u64) -> PathBuf {
    directory.join(format!("{PREFIX}{number:08}{SUFFIX}"))
}

/// The numbers of the files in `directory`, in order.
fn numbers(directory: &Path) -> io::Result<Vec<u64>> {
    let mut numbers = Vec::new();
    for entry in fs::read_dir(directory)? {
        let name = entry?.file_name();
        let number =
            name.to_str().and_then(|name| name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?.parse().ok());
        numbers.extend(number.filter(|number: &u64| path(directory, *number).file_name() == Some(&name)));
    }
    numbers.sort_unstable();
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Directory(PathBuf);

    impl Directory {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("axisd-audit-{name}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&path);
            Self(path)
        }
    }

    impl Drop for Directory {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_full_file_is_followed_by_another_and_the_oldest_make_room() {
        let directory = Directory::new("full");
        let mut files = Files::open(&directory.0, 20, 3).unwrap();
        (0..20).for_each(|number| files.append(&format!("line {number:02}")).unwrap());
        files.sync().unwrap();
        assert_eq!(numbers(&directory.0).unwrap(), [8, 9, 10], "two lines of eight bytes fit in each");
        let size: u64 =
            fs::read_dir(&directory.0).unwrap().map(|f| f.unwrap().metadata().unwrap().len()).sum();
        assert!(size <= 60);
        assert_eq!(last_lines(&directory.0, 3).unwrap(), ["line 17", "line 18", "line 19"]);
        assert_eq!(last_lines(&directory.0, 100).unwrap().len(), 6);
    }

    #[test]
    fn a_run_goes_on_behind_the_last_one_and_other_files_are_left_alone() {
        let directory = Directory::new("runs");
        Files::open(&directory.0, 100, 3).unwrap().append("one").unwrap();
        fs::write(directory.0.join("audit-notes.jsonl"), "mine").unwrap();
        fs::write(directory.0.join("audit-1.jsonl"), "mine, too").unwrap();
        Files::open(&directory.0, 100, 3).unwrap().append("two").unwrap();
        (0..3).for_each(|_| drop(Files::open(&directory.0, 100, 3).unwrap()));
        assert_eq!(numbers(&directory.0).unwrap(), [3, 4, 5]);
        assert!(directory.0.join("audit-notes.jsonl").exists() && directory.0.join("audit-1.jsonl").exists());
    }

    #[test]
    fn a_line_longer_than_a_file_has_one_of_its_own() {
        let directory = Directory::new("long");
        let mut files = Files::open(&directory.0, 10, 2).unwrap();
        files.append("a").unwrap();
        files.append("a line that is longer than a file").unwrap();
        files.append("b").unwrap();
        files.sync().unwrap();
        assert_eq!(last_lines(&directory.0, 9).unwrap(), ["a line that is longer than a file", "b"]);
    }
}
