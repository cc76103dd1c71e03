//! A web server of one folder, which counts what it sends.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// Serves a folder until the test ends.
pub struct Server {
    address: String,
    sent: Arc<AtomicU64>,
}

impl Server {
    pub fn of(folder: &Path) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("http://{}", listener.local_addr().unwrap());
        let sent = Arc::new(AtomicU64::new(0));
        let (folder, count) = (folder.to_path_buf(), sent.clone());
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (folder, count) = (folder.clone(), count.clone());
                std::thread::spawn(move || while answer(&stream, &folder, &count) {});
            }
        });
        Self { address, sent }
    }

    /// The URL of a file.
    pub fn url(&self, name: &str) -> PathBuf {
        format!("{}/{name}", self.address).into()
    }

    /// Bytes that were sent since the last call.
    pub fn sent(&self) -> u64 {
        self.sent.swap(0, Ordering::Relaxed)
    }
}

/// Makes a file older, as those are that were uploaded some time ago.
pub fn age(path: &Path) {
    let file = std::fs::File::options().append(true).open(path).unwrap();
    file.set_modified(SystemTime::now() - Duration::from_secs(3600))
        .unwrap();
}

/// Makes a file newer than all that began within the last seconds.
pub fn renew(path: &Path) {
    let file = std::fs::File::options().append(true).open(path).unwrap();
    file.set_modified(SystemTime::now() + Duration::from_secs(10))
        .unwrap();
}

/// A time as HTTP has it.
fn date(time: SystemTime) -> String {
    let seconds = time.duration_since(SystemTime::UNIX_EPOCH).unwrap();
    let (days, of_day) = (seconds.as_secs() / 86400, seconds.as_secs() % 86400);
    // The civil date, with years that begin in March.
    let z = days + 719_468;
    let (era, of_era) = (z / 146_097, z % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let names = "MarAprMayJunJulAugSepOctNovDecJanFeb";
    let name = &names[3 * month as usize..][..3];
    let year = year + era * 400 + u64::from(month >= 10);
    let week = &"ThuFriSatSunMonTueWed"[3 * (days % 7) as usize..][..3];
    let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    format!("{week}, {day:02} {name} {year} {hour:02}:{minute:02}:{second:02} GMT")
}

/// Answers one request; false if no other can follow.
fn answer(mut stream: &TcpStream, folder: &Path, sent: &AtomicU64) -> bool {
    let mut request = Vec::new();
    let mut byte = [0];
    while !request.ends_with(b"\r\n\r\n") {
        match stream.read(&mut byte) {
            Ok(1) => request.push(byte[0]),
            _ => return false,
        }
    }
    let text = String::from_utf8(request).unwrap();
    let name = text.split(' ').nth(1).unwrap().trim_start_matches('/');
    let path = folder.join(name);
    let Ok(content) = std::fs::read(&path) else {
        let head = "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n";
        return stream.write_all(head.as_bytes()).is_ok();
    };
    let changed = path.metadata().unwrap().modified().unwrap();
    let range = text.lines().find_map(|line| {
        let line = line.to_ascii_lowercase();
        let (low, high) = line.strip_prefix("range: bytes=")?.split_once('-')?;
        Some((low.parse::<usize>().ok()?, high.parse::<usize>().ok()?))
    });
    let (status, body) = match range.filter(|(low, _)| *low < content.len()) {
        Some((low, high)) => {
            let high = content.len().min(high + 1);
            let place = format!("bytes {low}-{}/{}", high - 1, content.len());
            let status = format!("206 Partial Content\r\nContent-Range: {place}");
            (status, &content[low..high])
        }
        None => ("200 OK".to_owned(), &content[..]),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nDate: {}\r\nLast-Modified: {}\r\nETag: \"{:08x}\"\r\nContent-Length: {}\r\n\r\n",
        date(SystemTime::now()),
        date(changed),
        crc32c::crc32c(&content),
        body.len()
    );
    sent.fetch_add(body.len() as u64, Ordering::Relaxed);
    stream.write_all(head.as_bytes()).is_ok() && stream.write_all(body).is_ok()
}
