//! The audit trail.

use std::path::{Path, PathBuf};

use config::{Audit, Gateway};

/// Where it is kept: where the configuration says, else beside what devices store.
pub(crate) fn directory(gateway: &Gateway, storage: Option<&Path>) -> Option<PathBuf> {
    let Audit { is_on, path, .. } = &gateway.service.audit;
    let own = path.clone().or_else(|| storage.map(|storage| storage.join("audit")));
    own.filter(|_| *is_on)
}
