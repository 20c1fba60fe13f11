//! What an HDF5 file may hold before anything is read from it: a results file may come from a stranger.
//!
//! HDF5 lets a dataset lie in other files (external storage, virtual datasets), lets names lead to other files or in a ring,
//! loads code for filters that it does not know, and allocates as many rows as a dataset claims. riprap writes none of
//! that, so a file with any of it is refused before a value is read.

use std::collections::BTreeSet;
use std::path::Path;

use hdf5::dataset::Layout;
use hdf5::filters::Filter;
use hdf5::{Dataset, File, LinkType, LocationType};

use crate::error::Result;

use super::store::{explain, failure};

/// Deflate makes no more than so many bytes of one.
const MOST_INFLATION: u64 = 1040;
/// Groups are nested no deeper than that.
const DEEPEST: usize = 16;

/// Refuses a file with anything in it that riprap never writes.
pub(super) fn inspect(file: &File, path: &Path) -> Result<()> {
    let size = file.size();
    let mut waiting = vec![("/".to_string(), 0)];
    let mut seen = BTreeSet::new();
    while let Some((name, depth)) = waiting.pop() {
        let trouble = |e: hdf5::Error| failure(path, &name, explain(&e));
        let group = file.group(&name).map_err(trouble)?;
        let place = group.loc_info().map_err(trouble)?;
        if !seen.insert(format!("{:?}", place.token)) || depth > DEEPEST {
            return Err(failure(
                path,
                &name,
                "is a group that lies within itself, which riprap never writes",
            ));
        }
        let mut members = Vec::new();
        let visited = group.iter_visit_default(|member, link| {
            members.push((member.to_string(), link.link_type));
            Ok(())
        });
        visited.map_err(trouble)?;
        for (member, link) in members {
            let member = if name == "/" { member } else { format!("{name}/{member}") };
            let trouble = |e: hdf5::Error| failure(path, &member, explain(&e));
            if link != LinkType::Hard {
                let message = "is a link to elsewhere, which riprap never writes";
                return Err(failure(path, &member, message));
            }
            match file.loc_type_by_name(&member).map_err(trouble)? {
                LocationType::Group => waiting.push((member, depth + 1)),
                LocationType::Dataset => {
                    let dataset = file.dataset(&member).map_err(trouble)?;
                    if let Some(fault) = fault_of(&dataset, size).map_err(trouble)? {
                        return Err(failure(path, &member, fault));
                    }
                }
                LocationType::NamedDatatype | LocationType::TypeMap => {}
            }
        }
    }
    Ok(())
}

/// Why a dataset is none of riprap's; `size` is the file's.
fn fault_of(dataset: &Dataset, size: u64) -> hdf5::Result<Option<String>> {
    let made = dataset.create_plist()?;
    if !made.get_external()?.is_empty() {
        return Ok(Some("lies in another file, which riprap never writes".into()));
    }
    let layout = made.get_layout()?;
    if layout == Layout::Virtual {
        return Ok(Some("is made of other datasets, which riprap never writes".into()));
    }
    let known = |filter: &Filter| matches!(filter, Filter::Deflate(_) | Filter::Shuffle | Filter::Fletcher32);
    if let Some(filter) = made.get_filters()?.iter().find(|filter| !known(filter)) {
        return Ok(Some(format!("needs a filter that riprap does not load: {filter:?}")));
    }
    let stored = dataset.storage_size();
    let bytes = dataset
        .shape()
        .iter()
        .try_fold(dataset.dtype()?.size() as u64, |bytes, &rows| bytes.checked_mul(rows as u64));
    // Compact values are in the header, which has at most 64 KiB.
    let most = stored.min(size).saturating_mul(MOST_INFLATION).saturating_add(1 << 16);
    if bytes.is_none_or(|bytes| bytes > most) {
        let shape = dataset.shape();
        return Ok(Some(format!("claims a shape of {shape:?} with {stored} bytes stored: it is damaged")));
    }
    Ok(None)
}
