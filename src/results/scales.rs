//! Dimension scales: what the axes of a dataset count, so that xarray, netCDF and h5py name them by themselves.
//!
//! Source: HDF5 Dimension Scale Specification and Design Notes, version 1.4 (The HDF Group, 2005). A scale is a dataset with the attributes
//! `CLASS` and `NAME`; a dataset along it lists its scales in `DIMENSION_LIST`; the scale lists its datasets in `REFERENCE_LIST`.
//! Scales lie in the group of what they measure: netCDF looks for a dimension there and above, nowhere else.

use hdf5::globals::H5T_C_S1;
use hdf5::types::VarLenArray;
use hdf5::{Dataset, H5Type, Location, ObjectReference1};
use hdf5_sys::h5a::{H5Aclose, H5Acreate2, H5Awrite};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::{H5S_class_t, H5Sclose, H5Screate};
use hdf5_sys::h5t::{H5Tclose, H5Tcopy, H5Tset_size};

use crate::error::Result;

use super::history::{GRAIN_QUANTITIES, HISTORY};
use super::store::{Growing, Layout, Store};
use super::writer::{HISTORY_ROWS, Writer};

const CLASS: &str = "CLASS";
const NAME: &str = "NAME";
const LIST: &str = "DIMENSION_LIST";
const USES: &str = "REFERENCE_LIST";

/// An entry of a scale's `REFERENCE_LIST`: a dataset and which of its axes.
#[derive(H5Type, Clone, Copy)]
#[repr(C)]
struct Use {
    dataset: ObjectReference1,
    dimension: i32,
}

impl Store {
    /// Makes a dataset a scale of this name.
    pub fn make_scale(&self, dataset: &Dataset, name: &str) -> Result<()> {
        for (attribute, text) in [(CLASS, "DIMENSION_SCALE"), (NAME, name)] {
            self.fixed_text_attribute(dataset, attribute, text)?;
        }
        Ok(())
    }

    /// Writes a text attribute of fixed length, the kind that every reader of scales and of VTKHDF knows.
    pub fn fixed_text_attribute(&self, on: &Location, attribute: &str, text: &str) -> Result<()> {
        match fixed_text(on.id(), attribute, text) {
            true => Ok(()),
            false => Err(self.fail(&format!("{}@{attribute}", on.name()), "cannot be written")),
        }
    }

    /// Writes a scale that numbers what it measures from 0.
    pub fn count_scale(&self, name: &str, count: usize, long_name: &str) -> Result<Dataset> {
        let numbers: Vec<i64> = (0..count as i64).collect();
        let scale = self.whole(name, &numbers, &[])?;
        self.describe(&scale, "1", long_name)?;
        self.make_scale(&scale, name.rsplit('/').next().unwrap_or(name))?;
        Ok(scale)
    }

    /// Notes that the axes of these datasets are measured by these scales, the first by the first. A dataset may have fewer axes.
    pub fn measure_by(&self, scales: &[&Dataset], datasets: &[&Dataset]) -> Result<()> {
        let reference = |dataset: &Dataset| {
            let name = dataset.name();
            self.hdf5(&name, self.file()?.reference::<ObjectReference1>(&name))
        };
        let found = scales.iter().map(|scale| reference(scale)).collect::<Result<Vec<_>>>()?;
        let mut uses: Vec<Vec<Use>> = vec![Vec::new(); scales.len()];
        for dataset in datasets {
            let (place, target) = (format!("{}@{LIST}", dataset.name()), reference(dataset)?);
            let axes = dataset.ndim();
            let lists: Vec<VarLenArray<ObjectReference1>> =
                found.iter().take(axes).map(|scale| VarLenArray::from_slice(&[*scale])).collect();
            if lists.len() != axes {
                return Err(self.fail(&place, format!("has {axes} axes and {} scales", scales.len())));
            }
            let made = dataset.new_attr::<VarLenArray<ObjectReference1>>().shape(axes).create(LIST);
            self.hdf5(&place, self.hdf5(&place, made)?.write(&lists))?;
            for (dimension, uses) in uses.iter_mut().enumerate().take(axes) {
                uses.push(Use { dataset: target, dimension: dimension as i32 });
            }
        }
        for (scale, new) in scales.iter().zip(uses) {
            self.add_uses(scale, new)?;
        }
        Ok(())
    }

    /// The columns of `/history`, in its order, go with the number of the increment.
    pub fn scale_history(&self, columns: &[Growing]) -> Result<()> {
        let (counts, others): (Vec<_>, Vec<_>) =
            columns.iter().zip(HISTORY).partition(|(_, quantity)| quantity.name == "increment");
        let measured: Vec<&Dataset> = others.iter().map(|(column, _)| &column.dataset).collect();
        for (increment, _) in counts {
            self.make_scale(&increment.dataset, "increment")?;
            self.measure_by(&[&increment.dataset], &measured)?;
        }
        Ok(())
    }

    fn add_uses(&self, scale: &Dataset, new: Vec<Use>) -> Result<()> {
        let place = format!("{}@{USES}", scale.name());
        let mut all = match scale.attr(USES) {
            Ok(there) => {
                let all = self.hdf5(&place, there.read_raw::<Use>())?;
                self.hdf5(&place, scale.delete_attr(USES))?;
                all
            }
            Err(_) => Vec::new(),
        };
        all.extend(new);
        if all.is_empty() {
            return Ok(());
        }
        let made = self.hdf5(&place, scale.new_attr::<Use>().shape(all.len()).create(USES))?;
        self.hdf5(&place, made.write(&all))
    }
}

impl Writer {
    /// Scales for the axes of a table that was just written: its rows, which are `item`s, and space.
    pub(super) fn scale_table(
        &mut self,
        group: &str,
        item: &str,
        rows: usize,
        columns: &[Dataset],
    ) -> Result<()> {
        let count = |name: &str, count: usize, what: &str| {
            self.store.count_scale(&format!("{group}/{name}"), count, what)
        };
        let items = count(item, rows, &format!("number of the {item}, counted from 0"))?;
        let axes = count("axis", 3, "axes of space: 0 x, 1 y, 2 z")?;
        self.store.measure_by(&[&items, &axes], &columns.iter().collect::<Vec<_>>())?;
        for scale in [items, axes] {
            self.store.raw_extents(&scale, &mut self.written)?;
        }
        Ok(())
    }

    /// Scales for the axes of the datasets of `/grains` that grow with the saved states, where the table of grains has brought its own.
    pub(super) fn scale_grains(&mut self) -> Result<()> {
        if !self.store.has("grains/grain")? {
            return Ok(());
        }
        let states = self.store.growing::<i64>("grains/state", &[], Layout::Rows(HISTORY_ROWS))?;
        self.store.describe(
            &states.dataset,
            "1",
            "number of the saved state, as in /VTKHDF and /contacts",
        )?;
        self.store.make_scale(&states.dataset, "state")?;
        let [grain, axis] = [self.store.open("grains/grain")?, self.store.open("grains/axis")?];
        let what = "components of a symmetric tensor: 0 xx, 1 yy, 2 zz, 3 xy, 4 yz, 5 xz";
        let component = self.store.count_scale("grains/component", 6, what)?;
        for (column, quantity) in self.grains.iter().zip(GRAIN_QUANTITIES) {
            let last = if quantity.width == 6 { &component } else { &axis };
            self.store.measure_by(&[&states.dataset, &grain, last], &[&column.dataset])?;
        }
        self.store.raw_extents(&component, &mut self.written)?;
        self.grain_states = Some(states);
        Ok(())
    }
}

/// Writes a text of fixed length that ends with a NUL, the only kind by which HDF5 before 2.0 knows a scale; the hdf5 crate pads without.
/// Tells whether it worked.
fn fixed_text(object: hid_t, attribute: &str, text: &str) -> bool {
    let ended = |text: &str| [text.as_bytes(), b"\0"].concat();
    let (name, value) = (ended(attribute), ended(text));
    let class = *H5T_C_S1;
    hdf5::sync::sync(|| {
        // SAFETY: both texts end with a NUL and live through the calls; `object` is an open dataset; the type has the length of `value`; what is
        // opened here is closed here. The closure runs under the lock of the hdf5 crate.
        unsafe {
            let kind = H5Tcopy(class);
            let space = H5Screate(H5S_class_t::H5S_SCALAR);
            let mut written = false;
            if kind >= 0 && space >= 0 && H5Tset_size(kind, value.len()) >= 0 {
                let made = H5Acreate2(object, name.as_ptr().cast(), kind, space, H5P_DEFAULT, H5P_DEFAULT);
                written = made >= 0 && H5Awrite(made, kind, value.as_ptr().cast()) >= 0;
                if made >= 0 {
                    H5Aclose(made);
                }
            }
            if kind >= 0 {
                H5Tclose(kind);
            }
            if space >= 0 {
                H5Sclose(space);
            }
            written
        }
    })
}
