//! Tracks whether any process of a user has an iceoryx2 node. The last one to exit removes the
//! files that iceoryx2 leaves.
//!
//! All nodes of a folder draw their numbers from one counter in it (`….global_mgmt`, 16 bytes).
//! iceoryx2 0.10 never removes the counter, because a node that still runs would then draw numbers
//! twice. A process with a node holds a shared lock on a file in the folder. A process that gets
//! the lock exclusively knows that there is no node. What the folder of nodes then holds was left by
//! processes that were killed while they started, or while they cleaned up after others; iceoryx2
//! does not find such nodes any more.

use super::wakeup;
use crate::sync::transport::LinkError;
use std::fs::{File, OpenOptions};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

const LOCK: &str = "nodes.lock";
const COUNTER: &str = ".global_mgmt";
/// The folder in which iceoryx2 keeps a few files for each node.
const NODES: &str = "nodes";

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
            let folder = self.path.parent().unwrap_or(Path::new(""));
            let _ = std::fs::remove_dir_all(folder.join(NODES));
            for file in std::fs::read_dir(folder)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A user that does not exist: the locks clean up its wakeups.
    const NOBODY: u32 = 4_000_000_002;

    #[test]
    fn the_last_lock_removes_what_killed_nodes_left() {
        let folder = std::env::temp_dir().join(format!("tumble-node-lock-{}", std::process::id()));
        let node = folder.join(NODES).join("77");
        std::fs::create_dir_all(&node).unwrap();
        let left = [node.join("a.port_tag"), folder.join(NODES).join("a.node_monitor"), folder.join("a.global_mgmt")];
        left.iter().for_each(|file| std::fs::write(file, b"").unwrap());
        let first = NodeLock::new(&folder, NOBODY).unwrap();
        let second = NodeLock::new(&folder, NOBODY).unwrap();
        drop(first);
        assert!(left.iter().all(|file| file.exists()), "another process may have a node");
        drop(second);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        std::fs::remove_dir(&folder).unwrap();
    }
}
