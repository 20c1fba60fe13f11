//! The Python package of scripts/riprap on the program: a case as a dict, checked, run and read.

use crate::two_grains::*;

#[test]
fn cases_are_checked_run_and_read_from_python() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let program = r#"
import os, sys, numpy
os.environ['RIPRAP'] = sys.argv[1]
os.chdir(sys.argv[2])
import riprap
case = {
    'title': 'Sixteen grains', 'seed': 4,
    'specimen': {'grains': 16, 'aspect': 1.5, 'grading': [['60 mm', 1.0], ['40 mm', 0.0]], 'void_ratio': 0.9,
                 'unreachable': 'nearest', 'cells_per_grain': 24},
    'rock': {'density': 2700, 'youngs_modulus': '30 GPa', 'poissons_ratio': 0.2},
    'contact': {'friction': 0.5},
    'stages': [{'kind': 'consolidate', 'pressure': '0.4 MPa'}, {'kind': 'shear', 'axial_strain': 0.001, 'increment': 1e-4}],
}
told = riprap.check(case, set={'/seed': 5})
assert 'sound' in told and 'grains' in told, told
try:
    riprap.check(dict(case, contact={'fricton': 0.5}))
except riprap.RiprapError as error:
    assert error.code == 1 and 'did you mean "friction"' in str(error), error
else:
    raise AssertionError('a misspelt key was called sound')
events = []
results = riprap.run(case, 'sixteen.vtkhdf', threads=1, progress=events.append)
assert results.status[0] == 'finished' and len(results.history) == 20, results.status
assert any(event.get('event') == 'begin' for event in events), events[:3]
# What was given stays nowhere else.
assert sorted(os.listdir('.')) == ['sixteen.vtkhdf'], os.listdir('.')
try:
    riprap.run(case, 'sixteen.vtkhdf')
except riprap.RiprapError as error:
    assert error.code == 2 and 'exists already' in str(error), error
else:
    raise AssertionError('a results file was replaced')
chains = results.force_chains()
pairs, force = chains['grains'], chains['force']
assert pairs.shape == (len(force), 2) and (pairs[:, 0] < pairs[:, 1]).all() and (force > 0).all()
assert (chains['strong'] == (force > force.mean())).all() and not chains['chained'][~chains['strong']].all()
assert numpy.allclose(chains['ends'][:, 0], results.file['grains/position'][-1][pairs[:, 0]])
# The share of grains in chains, as the program counts it.
chained = len(set(pairs[chains['chained']].ravel())) / 16
assert abs(chained - results.history['chained_fraction'][-1]) < 1e-12, (chained, results.history['chained_fraction'][-1])
grid = results.to_pyvista()
rest = results.to_pyvista(moved=False)
assert numpy.allclose(grid.points - rest.points, results.point_data('displacement'))
assert grid.GetCellData().GetArray('stress').GetComponentName(3) == 'xy'
count = results.to_stl('grains.stl')
assert os.path.getsize('grains.stl') == 84 + 50 * count
import pyvista
surface = pyvista.read('grains.stl')
volume = results.file['grains/volume'][:].sum()
assert abs(surface.volume / volume - 1) < 1e-3, (surface.volume, volume)
print('read')
"#;
    let arguments = [env!("CARGO_BIN_EXE_riprap"), dir.path().to_str().expect("path")];
    assert_eq!(run_python(&python, program, &arguments).trim(), "read");
}
