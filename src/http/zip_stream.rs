//! A zip of stored files, made while it is sent. Its bytes are the same every time, so that any range of it can be made.

use std::ops::Range;

use bytes::Bytes;
use futures_util::{Stream, StreamExt};

use crate::job::StoreError;
use crate::job::blobs::{BlobInfo, Blobs};

const LOCAL: u64 = 30;
const CENTRAL: u64 = 46;
const END: u64 = 22;
/// What zip's 32-bit fields end at; sets are refused before.
const MOST: u64 = u32::MAX as u64;
/// The same of its count of files.
const MOST_FILES: usize = u16::MAX as usize;
/// 1 January 1980, the first day there is.
const DAY: u16 = 0x21;

/// The files of a zip, each whole and as it is.
#[derive(Debug, Clone)]
pub struct ZipStream {
    files: Vec<(String, BlobInfo)>,
}

impl ZipStream {
    /// A zip of these files by name; `None` if they are more than zip's usual form can hold, 4 GB.
    pub fn new(files: Vec<(String, BlobInfo)>) -> Option<Self> {
        let zip = Self { files };
        let names = zip.files.iter().all(|(name, _)| name.len() <= usize::from(u16::MAX));
        (names && zip.size() <= MOST && zip.files.len() <= MOST_FILES).then_some(zip)
    }

    /// Bytes of the zip.
    pub fn size(&self) -> u64 {
        self.files.iter().map(|(name, blob)| LOCAL + CENTRAL + 2 * name.len() as u64 + blob.size).sum::<u64>()
            + END
    }

    /// A tag that is another where any file or name is.
    pub fn tag(&self) -> String {
        let list: String =
            self.files.iter().map(|(name, blob)| format!("{}\0{name}\n", blob.digest)).collect();
        format!("\"{}\"", crate::formats::Sha256::of(list.as_bytes()))
    }

    /// The bytes of a range of the zip. One file is in memory at a time.
    pub fn bytes(self, blobs: Blobs, range: Range<u64>) -> impl Stream<Item = Result<Bytes, StoreError>> {
        let parts = futures_util::stream::unfold(Some(Writer::new(self, blobs)), |writer| async move {
            let mut writer = writer?;
            match writer.next().await {
                Some(Ok(bytes)) => Some((Ok(bytes), Some(writer))),
                Some(Err(error)) => Some((Err(error), None)),
                None => None,
            }
        });
        let mut at = 0;
        parts.filter_map(move |part| {
            let cut = part.map(|bytes| {
                let whole = at..at + bytes.len() as u64;
                at = whole.end;
                let from = range.start.clamp(whole.start, whole.end) - whole.start;
                let to = range.end.clamp(whole.start, whole.end) - whole.start;
                (from < to).then(|| bytes.slice(from as usize..to as usize))
            });
            std::future::ready(cut.transpose())
        })
    }
}

/// Writes the zip a piece at a time.
struct Writer {
    zip: ZipStream,
    blobs: Blobs,
    at: usize,
    offset: u32,
    central: Vec<u8>,
    /// The file whose head has been written.
    body: Option<Bytes>,
    ended: bool,
}

impl Writer {
    fn new(zip: ZipStream, blobs: Blobs) -> Self {
        Self { zip, blobs, at: 0, offset: 0, central: Vec::new(), body: None, ended: false }
    }

    async fn next(&mut self) -> Option<Result<Bytes, StoreError>> {
        if let Some(body) = self.body.take() {
            return Some(Ok(body));
        }
        let Some((name, blob)) = self.zip.files.get(self.at).cloned() else {
            let first = !std::mem::replace(&mut self.ended, true);
            return first.then(|| Ok(self.end()));
        };
        self.at += 1;
        match self.blobs.read(blob.digest).await {
            Ok(body) => {
                let head = self.head(&name, &body);
                self.body = Some(body);
                Some(Ok(head))
            }
            Err(error) => Some(Err(error)),
        }
    }

    /// What stands before a file; what stands of it at the end is noted.
    fn head(&mut self, name: &str, body: &Bytes) -> Bytes {
        let size = u32::try_from(body.len()).unwrap_or(u32::MAX);
        // Version 2.0, names in UTF-8, stored.
        let mut shared = Vec::new();
        [20, 0x0800, 0, 0, DAY].iter().for_each(|field: &u16| shared.extend(field.to_le_bytes()));
        [crc32fast::hash(body), size, size].iter().for_each(|field| shared.extend(field.to_le_bytes()));
        [name.len() as u16, 0].iter().for_each(|field| shared.extend(field.to_le_bytes()));
        let head = [b"PK\x03\x04", &shared[..], name.as_bytes()].concat();
        self.central.extend(b"PK\x01\x02\x14\x00");
        self.central.extend(&shared);
        // No comment, disk 0, no attributes.
        self.central.extend([0; 10]);
        self.central.extend(self.offset.to_le_bytes());
        self.central.extend(name.as_bytes());
        self.offset = self.offset.saturating_add(head.len() as u32).saturating_add(size);
        head.into()
    }

    fn end(&self) -> Bytes {
        let files = (self.zip.files.len() as u16).to_le_bytes();
        let size = (self.central.len() as u32).to_le_bytes();
        let end = [
            &self.central[..],
            b"PK\x05\x06\0\0\0\0",
            &files,
            &files,
            &size,
            &self.offset.to_le_bytes(),
            &[0; 2],
        ];
        end.concat().into()
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read};

    use futures_util::TryStreamExt;

    use super::*;
    use crate::job::DataFolder;

    async fn made(zip: &ZipStream, blobs: &Blobs, range: Range<u64>) -> Vec<u8> {
        let parts: Vec<Bytes> = zip.clone().bytes(blobs.clone(), range).try_collect().await.unwrap();
        parts.concat()
    }

    #[tokio::test]
    async fn others_read_it_and_every_range_of_it_is_the_same() {
        let kept = tempfile::tempdir().unwrap();
        let folder = DataFolder::open(kept.path()).unwrap();
        let blobs = Blobs::open(folder.path()).unwrap();
        let mut files = Vec::new();
        for (name, text) in [("anna.glb", "first"), ("b/Jürgen.glb", "second, and longer"), ("empty", "")] {
            files.push((name.to_owned(), blobs.put_bytes(text).await.unwrap().info));
        }
        let zip = ZipStream::new(files).unwrap();
        let whole = made(&zip, &blobs, 0..zip.size()).await;
        assert_eq!(whole.len() as u64, zip.size());
        let mut archive = ::zip::ZipArchive::new(Cursor::new(&whole)).unwrap();
        let mut text = String::new();
        archive.by_name("b/Jürgen.glb").unwrap().read_to_string(&mut text).unwrap();
        assert_eq!((archive.len(), text.as_str()), (3, "second, and longer"));
        for (from, to) in [(0, 1), (3, 77), (40, 41), (70, zip.size()), (zip.size() - 1, zip.size())] {
            assert_eq!(made(&zip, &blobs, from..to).await, whole[from as usize..to as usize]);
        }
    }

    #[test]
    fn what_zip_cannot_hold_is_refused() {
        let digest = crate::formats::Sha256::of(b"");
        assert!(ZipStream::new(vec![("x".into(), BlobInfo { digest, size: MOST })]).is_none());
    }
}
