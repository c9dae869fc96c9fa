//! The iceoryx2 service type in use: the inter-process type of iceoryx2 with one change.
//!
//! All nodes of a folder draw their numbers from one counter. iceoryx2 0.10 shares that counter
//! between all users of a machine: `/dev/shm/….global_mgmt`, which every user may write and
//! truncate, and truncation kills each process that reads it. Here the counter is a file in the
//! run's folder, which no other user can enter, so its mode does not matter. All other objects in
//! `/dev/shm` have mode 600.

use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::{Service, internal::ServiceInternal};
use iceoryx2::unique_id_generator;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_cal::shm_allocator::{bump_allocator::BumpAllocator, pool_allocator::PoolAllocator};
use iceoryx2_cal::*;
use std::fmt::Debug;

/// Shared memory of one user.
#[derive(Clone, Debug)]
pub struct Private;

impl Service for Private {
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = dynamic_storage::file::Storage<T>;

    type StaticStorage = static_storage::recommended::Ipc;
    type ConfigSerializer = serialize::recommended::Recommended;
    type Bag = bag::recommended::Recommended;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = dynamic_storage::recommended::Ipc<T>;
    type ServiceNameHasher = hash::recommended::Recommended;
    type SharedMemory = shared_memory::recommended::Ipc<PoolAllocator>;
    type ResizableSharedMemory = resizable_shared_memory::recommended::Ipc<PoolAllocator>;
    type Connection = zero_copy_connection::recommended::Ipc;
    type Event = event::recommended::Ipc;
    type Monitoring = monitoring::recommended::Ipc;
    type Reactor = reactor::recommended::Ipc;
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> = arc_sync_policy::mutex_protected::MutexProtected<T>;
    type BlackboardMgmt<T: Debug + Send + Sync + ZeroCopySend + 'static> = dynamic_storage::recommended::Ipc<T>;
    type BlackboardPayload = shared_memory::recommended::Ipc<BumpAllocator>;
    type UniqueId = unique_id_generator::unique_system_id::UniqueSystemId;
}

impl ServiceInternal<Private> for Private {}
