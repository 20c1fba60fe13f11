//! The rubber membrane's sheet and its contacts in the forces and the tangent of the model.
//!
//! A node of the membrane is carried: by itself, where it is free, or by the plate that it is glued to. With
//! `r` from the carrier's position to the node, the node moves by `u + w x r`, and a force f on it is the force f and
//! the moment `r x f` on the carrier. So a stiffness K between two nodes is `T_i' K T_j` between their carriers, with
//! `T = [1, -[r]x]`, and a plate that turns changes the moment by `(w x r) x f` besides.

use crate::assembly::{BlockPattern, Contacts, Dofs};
use crate::model::{Membrane, Model};
use crate::tensor::{Mat3, Pose, Vec3, Vector6};

/// Adds the forces of the membrane's sheet and of its contacts to `wrenches`, one per carrier [N, N m].
pub fn membrane_forces_into(
    wrenches: &mut [Vector6<f64>],
    membrane: &Membrane,
    contacts: &Contacts,
    poses: &[Pose],
) {
    let positions = &contacts.membrane.positions;
    membrane.forces_into(wrenches, positions, poses);
    for list in &contacts.membrane.bodies {
        for point in &list.points {
            for (k, component) in point.force.on_body.iter().enumerate() {
                wrenches[list.body][k] += component;
            }
            for (&node, force) in point.contact.nodes().iter().zip(&point.force.on_membrane) {
                let carrier = membrane.nodes[node as usize].body;
                let moment = (positions[node as usize] - poses[carrier].position).cross(force);
                for k in 0..3 {
                    wrenches[carrier][k] += force[k];
                    wrenches[carrier][3 + k] += moment[k];
                }
            }
        }
    }
}

/// The carriers that the membrane's contacts may couple.
pub fn membrane_couplings<'a>(
    membrane: &'a Membrane,
    contacts: &'a Contacts,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    contacts.membrane.bodies.iter().flat_map(move |list| {
        list.named.iter().map(move |&node| (list.body, membrane.nodes[node as usize].body))
    })
}

/// The carriers that they couple now. A pattern made for all that they may couple holds these until something has
/// moved through the skin of the lists, and mostly beyond.
pub fn membrane_touching<'a>(
    membrane: &'a Membrane,
    contacts: &'a Contacts,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    contacts.membrane.points().flat_map(move |(body, point)| {
        point.contact.nodes().iter().map(move |&node| (body, membrane.nodes[node as usize].body))
    })
}

/// Where the stiffness goes.
struct Matrix<'a> {
    values: &'a mut [f64],
    pattern: &'a BlockPattern,
    dofs: &'a Dofs,
}

impl Matrix<'_> {
    fn add<const R: usize, const C: usize>(&mut self, row: usize, column: usize, block: &[[f64; C]; R]) {
        self.pattern.add_block(self.values, self.dofs, row, column, block);
    }
}

/// A node as its carrier sees it; `arm` [m] only where it is glued to a body that may turn.
#[derive(Clone, Copy)]
struct Carried {
    carrier: usize,
    arm: Option<Vec3>,
}

impl Carried {
    fn new(membrane: &Membrane, contacts: &Contacts, dofs: &Dofs, poses: &[Pose], node: usize) -> Self {
        let carrier = membrane.nodes[node].body;
        let turns = || dofs.of(carrier)[3..].iter().any(Option::is_some);
        let arm = (membrane.is_glued(node) && turns())
            .then(|| contacts.membrane.positions[node] - poses[carrier].position);
        Carried { carrier, arm }
    }
}

/// `T` of a node's arm, as columns: translation, then spin.
fn lever(arm: Option<Vec3>) -> [[f64; 6]; 3] {
    let turn = -arm.unwrap_or_default().cross_matrix();
    std::array::from_fn(|r| {
        std::array::from_fn(|c| if c < 3 { f64::from(u8::from(r == c)) } else { turn[(r, c - 3)] })
    })
}

/// `A B`.
fn product<const R: usize, const K: usize, const C: usize>(
    a: &[[f64; K]; R],
    b: &[[f64; C]; K],
) -> [[f64; C]; R] {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..K).map(|k| a[r][k] * b[k][c]).sum()))
}

/// `A' B`.
fn transposed_product<const R: usize, const K: usize, const C: usize>(
    a: &[[f64; R]; K],
    b: &[[f64; C]; K],
) -> [[f64; C]; R] {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..K).map(|k| a[k][r] * b[k][c]).sum()))
}

/// Adds the stiffness of a node's force by another node's position.
fn add_between(matrix: &mut Matrix<'_>, row: Carried, column: Carried, block: &[[f64; 3]; 3]) {
    match (row.arm, column.arm) {
        (None, None) => matrix.add(row.carrier, column.carrier, block),
        (row_arm, column_arm) => {
            let right = product(block, &lever(column_arm));
            matrix.add(row.carrier, column.carrier, &transposed_product(&lever(row_arm), &right));
        }
    }
}

/// Adds what turning the carrier does to the moment of a `force` [N] on a glued node: minus the derivative of
/// `(w x r) x f`, `(r.f) 1 - r f'`.
fn add_turning(matrix: &mut Matrix<'_>, node: Carried, force: &Vec3) {
    let Some(arm) = node.arm else { return };
    let turning = Mat3::from_diagonal_element(arm.dot(force)) - arm * force.transpose();
    let mut block = [[0.0; 6]; 6];
    for r in 0..3 {
        for c in 0..3 {
            block[3 + r][3 + c] = turning[(r, c)];
        }
    }
    matrix.add(node.carrier, node.carrier, &block);
}

/// The stiffness of the membrane's sheet and of its contacts. Call [`Contacts::update_tangents`] first.
pub fn membrane_stiffness_into(
    values: &mut [f64],
    model: &Model,
    pattern: &BlockPattern,
    dofs: &Dofs,
    contacts: &Contacts,
    poses: &[Pose],
) {
    let Some(membrane) = &model.membrane else { return };
    let mut matrix = Matrix { values, pattern, dofs };
    let carried = |node: usize| Carried::new(membrane, contacts, dofs, poses, node);
    membrane.for_each_stiffness_block(&contacts.membrane.positions, |i, j, stiffness| {
        let block: [[f64; 3]; 3] = std::array::from_fn(|r| std::array::from_fn(|c| stiffness[(r, c)]));
        add_between(&mut matrix, carried(i), carried(j), &block);
    });
    if (0..model.bodies.len())
        .any(|body| membrane.holds(body) && dofs.of(body)[3..].iter().any(Option::is_some))
    {
        let mut forces = vec![Vec3::zeros(); membrane.nodes.len()];
        membrane.node_forces_into(&mut forces, &contacts.membrane.positions);
        for (node, force) in forces.iter().enumerate().filter(|(node, _)| membrane.is_glued(*node)) {
            add_turning(&mut matrix, carried(node), force);
        }
    }
    for list in &contacts.membrane.bodies {
        for (point, tangent) in list.points.iter().zip(&list.tangents) {
            let all = point.contact.site.on_b.map(|node| carried(node as usize));
            let nodes = &all[..point.contact.nodes().len()];
            let Some((of_body, of_nodes)) = tangent.split_first_chunk::<6>() else { continue };
            add_rows_of_body(&mut matrix, list.body, nodes, of_body);
            let forces = &point.force.on_membrane;
            for ((&node, rows), force) in nodes.iter().zip(of_nodes.as_chunks::<3>().0).zip(forces) {
                add_rows_of_node(&mut matrix, node, list.body, nodes, rows);
                add_turning(&mut matrix, node, force);
            }
        }
    }
}

/// Columns of a node and of the body in the rows of a contact's tangent, as stiffness. Moving the body is moving the
/// nodes the other way.
fn of_node<const R: usize>(rows: &[[f64; 12]; R], node: usize) -> [[f64; 3]; R] {
    std::array::from_fn(|r| std::array::from_fn(|c| -rows[r][3 + 3 * node + c]))
}

fn of_body<const R: usize>(rows: &[[f64; 12]; R], count: usize) -> [[f64; 6]; R] {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| match c {
            0..3 => (0..count).map(|node| rows[r][3 + 3 * node + c]).sum(),
            _ => -rows[r][c - 3],
        })
    })
}

fn add_rows_of_body(matrix: &mut Matrix<'_>, body: usize, nodes: &[Carried], rows: &[[f64; 12]; 6]) {
    for (k, node) in nodes.iter().enumerate() {
        let block = of_node(rows, k);
        match node.arm {
            None => matrix.add(body, node.carrier, &block),
            Some(_) => matrix.add(body, node.carrier, &product(&block, &lever(node.arm))),
        }
    }
    matrix.add(body, body, &of_body(rows, nodes.len()));
}

fn add_rows_of_node(
    matrix: &mut Matrix<'_>,
    row: Carried,
    body: usize,
    nodes: &[Carried],
    rows: &[[f64; 12]; 3],
) {
    for (k, &node) in nodes.iter().enumerate() {
        add_between(matrix, row, node, &of_node(rows, k));
    }
    let block = of_body(rows, nodes.len());
    match row.arm {
        None => matrix.add(row.carrier, body, &block),
        Some(_) => matrix.add(row.carrier, body, &transposed_product(&lever(row.arm), &block)),
    }
}
