use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lru::LruCache;

use super::work::PlanFile;
use crate::formats::Sha256;
use crate::pipeline::{Prepared, Subject};

/// Plans that are kept.
const PLANS: NonZeroUsize = NonZeroUsize::new(16).unwrap();

/// What steps made ready of scans and plans, by what it was made of, so that the steps after them need not. It changes no
/// result: what is not there is made again.
pub(super) struct Cache {
    scans: Mutex<Scans>,
    plans: Mutex<LruCache<Sha256, Arc<PlanFile>>>,
}

struct Scans {
    kept: LruCache<Key, (Kept, usize)>,
    bytes: usize,
    most: usize,
}

/// What a scan was read from, and with a plan what it was prepared for.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Key {
    /// The scan's files and its name.
    pub scan: String,
    /// The plan.
    pub plan: Option<Sha256>,
}

#[derive(Clone)]
enum Kept {
    Read(Arc<Subject>),
    Prepared(Arc<Prepared>),
}

impl Cache {
    /// A cache of about so many bytes.
    pub fn new(most: usize) -> Self {
        let scans = Scans { kept: LruCache::unbounded(), bytes: 0, most };
        Self { scans: Mutex::new(scans), plans: Mutex::new(LruCache::new(PLANS)) }
    }

    /// A scan that was read.
    pub fn subject(&self, key: &Key) -> Option<Arc<Subject>> {
        match lock(&self.scans).kept.get(key)? {
            (Kept::Read(subject), _) => Some(subject.clone()),
            _ => None,
        }
    }

    /// A scan that was made ready for a plan.
    pub fn prepared(&self, key: &Key) -> Option<Arc<Prepared>> {
        match lock(&self.scans).kept.get(key)? {
            (Kept::Prepared(prepared), _) => Some(prepared.clone()),
            _ => None,
        }
    }

    /// Keeps a scan that was read.
    pub fn keep_subject(&self, key: Key, subject: &Arc<Subject>) {
        let bytes = 24 * subject.mesh.positions().len() + 12 * subject.mesh.triangles().len();
        lock(&self.scans).keep(key, Kept::Read(subject.clone()), bytes);
    }

    /// Keeps a scan that was made ready.
    pub fn keep_prepared(&self, key: Key, prepared: &Arc<Prepared>) {
        lock(&self.scans).keep(key, Kept::Prepared(prepared.clone()), prepared.bytes());
    }

    /// Forgets what was made ready for plans that are no longer needed.
    pub fn forget(&self, plans: &[Sha256]) {
        lock(&self.scans).forget(plans);
        let mut kept = lock(&self.plans);
        plans.iter().for_each(|plan| drop(kept.pop(plan)));
    }

    /// A plan.
    pub fn plan(&self, digest: Sha256) -> Option<Arc<PlanFile>> {
        lock(&self.plans).get(&digest).cloned()
    }

    /// Keeps a plan.
    pub fn keep_plan(&self, digest: Sha256, plan: &Arc<PlanFile>) {
        lock(&self.plans).put(digest, plan.clone());
    }
}

impl Scans {
    fn forget(&mut self, plans: &[Sha256]) {
        let gone = |key: &&Key| key.plan.is_some_and(|plan| plans.contains(&plan));
        let gone: Vec<Key> = self.kept.iter().map(|(key, _)| key).filter(gone).cloned().collect();
        for key in gone {
            self.bytes -= self.kept.pop(&key).map_or(0, |(_, bytes)| bytes);
        }
    }

    fn keep(&mut self, key: Key, kept: Kept, bytes: usize) {
        if let Some((_, before)) = self.kept.put(key, (kept, bytes)) {
            self.bytes -= before;
        }
        self.bytes += bytes;
        while self.bytes > self.most {
            let Some((_, (_, bytes))) = self.kept.pop_lru() else { return };
            self.bytes -= bytes;
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{LandmarkSet, TriangleMesh};
    use glam::DVec3;

    #[test]
    fn it_stays_within_its_bytes_and_forgets_what_was_used_least_recently() {
        let mesh = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]).unwrap();
        let subject =
            Arc::new(Subject { name: "a".into(), mesh, landmarks: LandmarkSet::default(), mask: None });
        let key = |name: &str| Key { scan: name.to_owned(), plan: None };
        // One is 84 bytes.
        let cache = Cache::new(2 * 84);
        cache.keep_subject(key("1"), &subject);
        cache.keep_subject(key("2"), &subject);
        assert!(cache.subject(&key("1")).is_some());
        cache.keep_subject(key("3"), &subject);
        assert!(cache.subject(&key("2")).is_none());
        assert!(cache.subject(&key("1")).is_some() && cache.subject(&key("3")).is_some());
        assert!(cache.prepared(&key("1")).is_none());
        cache.keep_subject(key("3"), &subject);
        assert!(cache.subject(&key("1")).is_some());
    }
}
