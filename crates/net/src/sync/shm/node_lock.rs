//! Tracks whether any process of a user has an iceoryx2 node. The last one to exit removes the
//! files that iceoryx2 leaves.
//!
//! All nodes of a folder draw their numbers from one counter in it (`….global_mgmt`, 16 bytes).
//! iceoryx2 0.10 never removes the counter, because a node that still runs would then draw numbers
//! twice. A process with a node holds a shared lock on a file in the folder. A process that gets
//! the lock exclusively knows that there is no node.

use super::wakeup;
use crate::sync::transport::LinkError;
use std::fs::{File, OpenOptions};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

const LOCK: &str = "nodes.lock";
const COUNTER: &str = ".global_mgmt";

/// Held by a process while it has a node, and dropped after the node.
pub struct NodeLock {
    file: File,
    path: PathBuf,
    user: u32,
}

impl NodeLock {
    /// Takes the shared lock.
    ///
    /// # Errors
    /// The file cannot be created or locked.
    pub fn new(folder: &Path, user: u32) -> Result<NodeLock, LinkError> {
        let path = folder.join(LOCK);
        let io = |why| LinkError::Io { what: format!("shared memory: {}", path.display()), why };
        loop {
            let file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .open(&path)
                .map_err(io)?;
            file.lock_shared().map_err(io)?; // an exclusive holder removes two files and releases the lock
            // the removed files may include this one
            if std::fs::metadata(&path).is_ok_and(|there| file.metadata().is_ok_and(|ours| there.ino() == ours.ino())) {
                return Ok(NodeLock { file, path, user });
            }
        }
    }

    /// Returns the user id.
    pub fn user(&self) -> u32 {
        self.user
    }
}

impl Drop for NodeLock {
    fn drop(&mut self) {
        wakeup::clean_up(self.user);
        if self.file.unlock().is_ok() && self.file.try_lock().is_ok() {
            let folder = self.path.parent().and_then(|folder| std::fs::read_dir(folder).ok());
            for file in folder
                .into_iter()
                .flatten()
                .flatten()
                .filter(|file| file.file_name().as_encoded_bytes().ends_with(COUNTER.as_bytes()))
            {
                let _ = std::fs::remove_file(file.path());
            }
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
