//! The table of everything a case file may contain: keys, forms, ranges, defaults.
//!
//! [`super::types`] has the same names; a test fills in every key and reads it into the types.

use super::bring::{HULL, PACKED_GRAINS, POROSITY, POSITION, ROTATION, SHAPES, SIEVE};
use super::form::{Form, Key, Kind, Range, positive, within};
use crate::quantity::Dimension;

use Form::{Choice, Count, Flag, Kinds, List, Named, Nullable, Object, OneOf, Quantity, Text, Tuple};

const LENGTH: Form = Quantity(Dimension::Length, positive(1e3));
const SIGNED_LENGTH: Form = Quantity(Dimension::Length, within(-1e6, 1e6));
const PRESSURE: Form = Quantity(Dimension::Pressure, positive(1e10));
const FRICTION: Form = Quantity(Dimension::None, within(0.0, 10.0));
const STRAIN: Form = Quantity(Dimension::None, positive(0.5));
const TOLERANCE: Form = Quantity(Dimension::None, positive(0.1));
const FORCE: Form = Quantity(Dimension::Force, within(-1e15, 1e15));
const MOMENT: Form = Quantity(Dimension::Moment, within(-1e15, 1e15));
const ANGLE: Form = Quantity(Dimension::Angle, within(-1e3, 1e3));
const ACCELERATION: Form = Quantity(Dimension::Acceleration, within(-1e6, 1e6));
const INCREMENTS: Form = Count(1, 1_000_000);
const FIDELITY: Form = Choice(&["rigid", "condensed", "full"]);

/// The whole file.
pub static CASE: Form = Object(CASE_KEYS);

static CASE_KEYS: &[Key] = &[
    Key::optional("$schema", Text, "Address of this schema, for editors; ignored."),
    Key::default("title", Text, "\"\"", "What the case is, for reports."),
    Key::default(
        "seed",
        Count(0, u64::MAX),
        "0",
        "Seed of all randomness: the same seed gives the same bits.",
    ),
    Key::optional(
        "start_from",
        Text,
        "A results file, relative to the case file: the stages begin with the specimen as it stands there after its \
         consolidation, or, where there is none yet and the first stage consolidates, with the specimen as generated.",
    ),
    Key::optional("specimen", Object(SPECIMEN), "A generated rockfill specimen. A case has this or a scene."),
    Key::optional("scene", Object(SCENE), "Bodies set by hand. A case has this or a specimen."),
    Key::required("rock", Object(ROCK), "The material of the grains."),
    Key::required("contact", Object(CONTACT), "Contact between grains."),
    Key::derived("plates", Object(PLATES), "the friction of contact", "The rigid end plates of a specimen."),
    Key::derived(
        "membrane",
        Kinds(MEMBRANE),
        "{\"kind\": \"pressure\"}",
        "What confines a specimen at its side.",
    ),
    Key::required("stages", List(&Kinds(STAGES), 1), "What is done to the specimen or scene, in order."),
    Key::default("solver", Object(SOLVER), "{}", "Tolerances and step control."),
    Key::default("output", Object(OUTPUT), "{}", "What goes to the results file, and how often."),
];

pub static SPECIMEN: &[Key] = &[
    Key::optional(
        "diameter",
        LENGTH,
        "Diameter of the compacted specimen; with height it gives the number of grains.",
    ),
    Key::optional("height", LENGTH, "Height of the compacted specimen."),
    Key::optional(
        "grains",
        Count(1, 10_000_000),
        "Number of grains; with aspect it gives the size of the specimen.",
    ),
    Key::optional("aspect", Quantity(Dimension::None, within(0.1, 20.0)), "Height over diameter."),
    Key::required(
        "grading",
        Form::OrBrought(
            &List(&Tuple(&[LENGTH, Quantity(Dimension::None, within(0.0, 1.0))]), 2),
            &Form::Either(&[Text, Object(SIEVE)]),
        ),
        "Sieve size and mass fraction passing, from the largest size (1) down to the smallest (0); or a CSV of them; or an object that also cuts or scales it.",
    ),
    Key::optional(
        "porosity",
        Form::Brought(&POROSITY),
        "In place of void_ratio: volume of voids over the whole volume.",
    ),
    Key::default(
        "within_class",
        Choice(&["number", "mass"]),
        "\"number\"",
        "How sizes are drawn between neighbouring sieves: uniform by number, as in the source, or so that the mass follows a straight line between the points of the grading.",
    ),
    Key::required(
        "void_ratio",
        Quantity(Dimension::None, within(0.05, 2.0)),
        "Volume of voids over volume of solids of the compacted specimen; this or porosity is needed.",
    ),
    Key::default(
        "vertices",
        Tuple(&[Count(4, 64), Count(4, 64)]),
        "[8, 16]",
        "Fewest and most vertices of a grain; their number is uniform between.",
    ),
    Key::default(
        "vertex_separation",
        Quantity(Dimension::None, within(0.0, 0.8)),
        "0.45",
        "Least distance of two vertices of a grain on its unit sphere; 0 switches the rejection off.",
    ),
    Key::default(
        "unreachable",
        Choice(&["refuse", "nearest"]),
        "\"refuse\"",
        "What to do where compaction cannot reach the void_ratio: stop with the range, or take its nearest end.",
    ),
    SHAPES,
    PACKED_GRAINS,
    Key::default("cells_per_grain", Count(1, 100_000), "38", "Quadratic tetrahedra per grain, about."),
];

static SCENE: &[Key] = &[
    Key::required("bodies", List(&Object(BODY), 1), "The bodies; touching is fine, overlapping is not."),
    Key::default("gravity", ACCELERATION_VECTOR, "[0, 0, 0]", "Acceleration of gravity in space axes."),
    Key::optional(
        "press",
        Object(PRESS),
        "A crushing test: one condensed body with damage between two box plates, every surface node against their faces. \
         The body is set on the lower plate and the upper one on the body; load stages drive that along z.",
    ),
];

static PRESS: &[Key] = &[
    Key::required("body", Text, "Name of the body that is pressed."),
    Key::required(
        "bottom",
        Text,
        "Name of the plate below it, a fixed box; only what its face covers can be met.",
    ),
    Key::required("top", Text, "Name of the plate above it, a box that load stages drive along z."),
    Key::default(
        "grip",
        Choice(&["rough", "frictionless", "tied"]),
        "\"rough\"",
        "Whether a touching node sticks, slides freely, or its end face is tied along z (to pull). The coefficients of contact have no part in it.",
    ),
    Key::optional(
        "patch",
        LENGTH,
        "Radius of the patch of surface by which a node meets a plate, its force spread over it; contacts of asperities take a fifth of a grain's diameter. Without it a node stands alone, and tips crush cell by cell.",
    ),
];

const ACCELERATION_VECTOR: Form = Tuple(&[ACCELERATION, ACCELERATION, ACCELERATION]);

static BODY: &[Key] = &[
    Key::required("name", Text, "Unique; names the body in stages and results."),
    Key::required("shape", OneOf(SHAPE), "The body's nominal shape, in its own axes."),
    Key::optional("mesh_size", LENGTH, "Edge length of the cells of a deformable body, about."),
    Key::optional("refine", Object(REFINE), "A ball in which a deformable sphere has smaller cells."),
    Key::default("position", POSITION, "[0, 0, 0]", "Reference point of displacement, force and moment."),
    Key::default(
        "rotation",
        ROTATION,
        "[0, 0, 0]",
        "Rotation vector (axis times angle) from body to space axes.",
    ),
    Key::optional("fidelity", FIDELITY, "How the body deforms; without it, as the solver's fidelity says."),
    Key::optional("rock", Form::Overrides(ROCK), "Material values that differ from the case's rock."),
    Key::optional(
        "friction",
        FRICTION,
        "Replaces the peak friction of contact on this body; of two touching bodies the lower value rules.",
    ),
    Key::optional("rounding", LENGTH, "Radius of edges and corners; replaces contact.rounding on this body."),
    Key::default("fixed", Flag, "false", "Holds its motion at zero; rigid, it does not yield at contacts."),
];

static REFINE: &[Key] = &[
    Key::required("point", POSITION, "Its centre, in body axes."),
    Key::required("radius", LENGTH, "Its radius."),
    Key::required("mesh_size", LENGTH, "Edge length of the cells in it."),
];

pub static SHAPE: &[Key] = &[
    Key::optional("box", Tuple(&[LENGTH, LENGTH, LENGTH]), "Full edge lengths; centred on the position."),
    Key::optional("sphere", LENGTH, "Radius; centred on the position."),
    Key::optional("cylinder", Object(CYLINDER), "About the z axis, centred on the position, as a prism."),
    Key::optional(
        "grain",
        Tuple(&[LENGTH, LENGTH]),
        "A random grain, as specimens have them, of the size class between these sieve sizes; its shape follows from the seed. It lies on its lowest facet, its centroid on the position.",
    ),
    Key::optional(
        "polyhedron",
        List(&POSITION, 4),
        "Vertices relative to the position; their convex hull is the body.",
    ),
    Key::optional(
        "mesh",
        Text,
        "A .vtu or .msh file of tetrahedra, relative to the case file; nodes in metres, relative to the position.",
    ),
    Key::optional(
        "hull",
        Form::Brought(&Object(HULL)),
        "The convex hull of a surface or mesh file: a scanned grain.",
    ),
];

static CYLINDER: &[Key] = &[
    Key::required("radius", LENGTH, "Of its corners."),
    Key::required("length", LENGTH, "Along the z axis."),
    Key::default(
        "sides",
        Count(3, 512),
        "24",
        "Sides of the prism; with a multiple of four it has flats on both sides of the x and y axes. It weighs as the prism does: with 24 sides 1.1 % less than a round one.",
    ),
];

static ROCK: &[Key] = &[
    Key::required("density", Quantity(Dimension::Density, positive(1e5)), "Mass per volume of solid rock."),
    Key::required("youngs_modulus", Form::Scattered(YOUNGS_MODULUS), "Elastic modulus of the cells."),
    Key::required("poissons_ratio", Form::Scattered(POISSONS_RATIO), "Poisson's ratio of the cells."),
    Key::optional(
        "compressive_strength",
        Form::Scattered(STRENGTH),
        "Uniaxial compressive strength of the cells.",
    ),
    Key::optional("tensile_strength", Form::Scattered(STRENGTH), "Uniaxial tensile strength of the cells."),
    Key::default(
        "damage",
        Nullable(&Object(DAMAGE)),
        "null",
        "Softening after the strength is reached; null is elastic.",
    ),
];

const fn mean(form: Form) -> Key {
    Key::required("mean", form, "Expected value over the cells.")
}

const LAW: Key = Key::derived(
    "law",
    Choice(&["constant", "weibull", "normal", "lognormal", "gamma", "exponential"]),
    "weibull if weibull_shape is given, gamma if gamma_shape, lognormal if variation, else constant",
    "Distribution of the cells' values.",
);
const WEIBULL_SHAPE: Key = Key::optional(
    "weibull_shape",
    Quantity(Dimension::None, within(0.5, 1e6)),
    "Shape parameter of a Weibull law: the larger, the more uniform.",
);
const VARIATION: Key = Key::optional(
    "variation",
    Quantity(Dimension::None, positive(2.0)),
    "Standard deviation over mean of a lognormal or normal law.",
);
const GAMMA_SHAPE: Key = Key::optional(
    "gamma_shape",
    Quantity(Dimension::None, within(0.5, 1e6)),
    "Shape parameter of a gamma law.",
);

static YOUNGS_MODULUS: &[Key] =
    &[mean(Quantity(Dimension::Pressure, within(1e3, 1e13))), LAW, WEIBULL_SHAPE, GAMMA_SHAPE, VARIATION];
static POISSONS_RATIO: &[Key] = &[
    mean(Quantity(Dimension::None, Range { low: 0.0, above: false, high: 0.495, below: true })),
    LAW,
    WEIBULL_SHAPE,
    GAMMA_SHAPE,
    VARIATION,
];
static STRENGTH: &[Key] = &[
    mean(Quantity(Dimension::Pressure, within(1e3, 1e11))),
    LAW,
    WEIBULL_SHAPE,
    GAMMA_SHAPE,
    VARIATION,
    Key::optional(
        "reference_size",
        LENGTH,
        "Edge of the cube of rock that the mean of a Weibull law is meant for: a cell of volume V is stronger by (reference_size^3 / V)^(1/weibull_shape), the weakest link. Without it the mean is every cell's, whatever its size.",
    ),
];

static DAMAGE: &[Key] = &[
    Key::default(
        "exponent",
        Quantity(Dimension::None, Range { low: 1.0, above: true, high: 100.0, below: false }),
        "3",
        "N of the softening law sigma = E e0 (e0/e)^(N-1) beyond the peak strain e0.",
    ),
    Key::default(
        "threshold",
        Quantity(Dimension::None, Range { low: 0.0, above: true, high: 1.0, below: true }),
        "0.99",
        "Damage at which an integration point carries nothing any more.",
    ),
    Key::default(
        "recovery_in_compression",
        Quantity(Dimension::None, within(0.0, 1.0)),
        "1",
        "Share of the stiffness lost in tension that returns in compression.",
    ),
    Key::default(
        "recovery_in_tension",
        Quantity(Dimension::None, within(0.0, 1.0)),
        "0",
        "Share of the stiffness lost in compression that returns in tension.",
    ),
    Key::default(
        "fracture_energy",
        Nullable(&Quantity(Dimension::EnergyPerArea, positive(1e9))),
        "null",
        "Crack-band regularisation: the exponent then follows from this and the cell size; null is off.",
    ),
    Key::default(
        "least_fragment",
        Quantity(Dimension::None, Range { low: 0.0, above: true, high: 0.5, below: false }),
        "0.02",
        "Parts that come apart with less than this share of the volume of the grain as generated are dust: they leave the model, and count as deleted cells and in the finest class of the grading.",
    ),
    Key::default(
        "rubble",
        Choice(&["removed", "kept"]),
        "\"removed\"",
        "Cells that have failed: removed, as in the source, so that the rock loses their volume and what they held falls in; or kept as rubble that carries no stress inside the grain but goes on taking its room in contacts, a tenth as stiff. Kept is for grains that are rigid in their contacts.",
    ),
    Key::optional(
        "release_steps",
        Count(1, 1000),
        "Without effect: what failed rock held goes at once, against the drag of solver.stabilisation.",
    ),
];

static CONTACT: &[Key] = &[
    Key::required("friction", FRICTION, "Peak friction coefficient."),
    Key::derived("residual_friction", FRICTION, "friction", "Friction coefficient after long sliding."),
    Key::derived(
        "weakening_distance",
        LENGTH,
        "of specimens a quarter of the size that half of the mass passes, of scenes 50 um",
        "Slip over which friction decays from peak to residual by 1/e.",
    ),
    Key::default(
        "rounding",
        Quantity(Dimension::None, within(0.001, 0.1)),
        "0.02",
        "Radius of edges and corners over the size of the grain (of a scene's body: its smallest extent along its own axes).",
    ),
    Key::derived(
        "faces",
        Choice(&["corners", "area"]),
        "area of scenes with springs, else corners",
        "What parallel faces carry by: their corners and edges, or a pressure over the area that they share.",
    ),
    Key::derived(
        "normal",
        Choice(&["spring", "asperity"]),
        "asperity of specimens, spring of scenes",
        "What bears the normal force between bodies: asperities, whose rounding is elastic up to the limit pressure and crushed beyond, or a spring that goes with their size alone. A rigid wall meets grains by springs.",
    ),
    Key::optional(
        "limit_pressure",
        PRESSURE,
        "Crushes rock at asperities; else 2.8 times its mean compressive strength. Without either nothing is crushed.",
    ),
];

static PLATES: &[Key] = &[
    Key::derived(
        "friction",
        FRICTION,
        "the friction of contact",
        "Friction of grains on plates; 0 makes them smooth.",
    ),
    Key::default(
        "tilting",
        Choice(&["locked", "free"]),
        "\"locked\"",
        "Whether the top plate stays level; the bottom plate is fixed.",
    ),
];

static MEMBRANE: &[Kind] = &[
    Kind {
        name: "rubber",
        about: "A hyperelastic membrane bonded to the plates.",
        keys: &[
            Key::default("thickness", LENGTH, "\"2 mm\"", "Undeformed thickness."),
            Key::default("shear_modulus", PRESSURE, "\"0.45 MPa\"", "Shear modulus at small strain."),
            Key::default(
                "law",
                Choice(&["neo_hookean", "mooney_rivlin", "gent"]),
                "\"neo_hookean\"",
                "Energy law of the rubber; gent stiffens towards a largest stretch.",
            ),
            Key::default(
                "mooney_share",
                Quantity(Dimension::None, within(0.0, 1.0)),
                "0.2",
                "Share of the shear modulus that comes with the second invariant, for mooney_rivlin.",
            ),
            Key::default(
                "gent_limit",
                Quantity(Dimension::None, positive(1e4)),
                "30",
                "Largest I1 - 3, the sum of the squared stretches less 3, for gent.",
            ),
            Key::optional(
                "mesh_size",
                LENGTH,
                "Edge length of the membrane's triangles; without it, from the grains.",
            ),
        ],
    },
    Kind {
        name: "pressure",
        about: "Pressure on the grains through a weightless flexible cover.",
        keys: &[Key::derived(
            "rims",
            Choice(&["bonded", "sliding"]),
            "sliding on plates without friction, else bonded",
            "How its rims go with the plates: with the plate, or along it with the grains, so that no sideways pressure is left to the plates.",
        )],
    },
    Kind {
        name: "rigid_wall",
        about: "A rigid smooth cylinder whose mean pressure is the confining pressure; for tests.",
        keys: &[],
    },
];

const AXIAL_STRAIN: Key =
    Key::required("axial_strain", STRAIN, "Axial strain added in this stage, shortening positive.");
const INCREMENT: Key = Key::default("increment", STRAIN, "1e-4", "Axial strain of a nominal increment.");
const INCREMENT_MAX: Key = Key::derived(
    "increment_max",
    STRAIN,
    "increment times the solver's increment_max",
    "Axial strain of the largest increment.",
);
const DEVIATORIC_STRESS: Form = Quantity(Dimension::Pressure, within(0.0, 1e10));
const UNTIL: Key = Key::default(
    "until",
    Object(UNTIL_KEYS),
    "{}",
    "What ends the stage before its axial strain is reached; the first that comes true.",
);
const HELD_PRESSURE: Key = Key::derived(
    "pressure",
    PRESSURE,
    "the confining pressure of the stage before",
    "Confining pressure held; it must be the one reached before.",
);

static UNTIL_KEYS: &[Key] = &[
    Key::optional(
        "deviatoric_stress",
        DEVIATORIC_STRESS,
        "The last increment lands on this deviatoric stress.",
    ),
    Key::optional(
        "drop_after_peak",
        Quantity(Dimension::None, Range { low: 0.0, above: true, high: 1.0, below: true }),
        "A peak is passed: the deviatoric stress has lost this share of the stage's largest.",
    ),
];

static STAGES: &[Kind] = &[
    Kind {
        name: "consolidate",
        about: "Brings the specimen to a pressure: isotropic, or axial and radial.",
        keys: &[
            Key::optional("pressure", PRESSURE, "Isotropic pressure; or give the two below."),
            Key::optional("axial_pressure", PRESSURE, "Pressure on the plates."),
            Key::optional("radial_pressure", PRESSURE, "Pressure on the membrane."),
            Key::default("increments", INCREMENTS, "10", "Nominal number of increments."),
        ],
    },
    Kind {
        name: "shear",
        about: "Drives the top plate down at constant confining pressure.",
        keys: &[AXIAL_STRAIN, INCREMENT, INCREMENT_MAX, UNTIL, HELD_PRESSURE],
    },
    Kind {
        name: "stress_shear",
        about: "Loads the top plate to a deviatoric stress at constant confining pressure.",
        keys: &[
            Key::required("deviatoric_stress", DEVIATORIC_STRESS, "Where the stage ends."),
            Key::default("increments", INCREMENTS, "20", "Nominal number of increments."),
            HELD_PRESSURE,
        ],
    },
    Kind {
        name: "unload",
        about: "Lifts the top plate until the deviatoric stress is back, at constant confining pressure.",
        keys: &[
            Key::default("deviatoric_stress", DEVIATORIC_STRESS, "0", "Where unloading ends."),
            INCREMENT,
            INCREMENT_MAX,
            HELD_PRESSURE,
        ],
    },
    Kind {
        name: "reload",
        about: "Drives the top plate down again after an unload stage.",
        keys: &[
            Key::default(
                "axial_strain",
                Nullable(&STRAIN),
                "null",
                "Axial strain added in this stage; null returns to where unloading began.",
            ),
            INCREMENT,
            INCREMENT_MAX,
            UNTIL,
            HELD_PRESSURE,
        ],
    },
    Kind {
        name: "oedometer",
        about: "Drives the top plate down at constant mean cross-section; the confining pressure follows.",
        keys: &[AXIAL_STRAIN, INCREMENT, INCREMENT_MAX, UNTIL],
    },
    Kind {
        name: "constant_volume",
        about: "Drives the top plate down at constant volume; the confining pressure follows.",
        keys: &[AXIAL_STRAIN, INCREMENT, INCREMENT_MAX, UNTIL],
    },
    Kind {
        name: "constant_p",
        about: "Drives the top plate down at constant mean stress; the confining pressure follows.",
        keys: &[AXIAL_STRAIN, INCREMENT, INCREMENT_MAX, UNTIL],
    },
    Kind {
        name: "hold",
        about: "Changes no load or prescribed motion.",
        keys: &[Key::default("increments", INCREMENTS, "1", "Number of increments.")],
    },
    Kind {
        name: "load",
        about: "Moves and loads the bodies of a scene, linearly over the stage.",
        keys: &[
            Key::default("increments", INCREMENTS, "10", "Nominal number of increments."),
            Key::default("bodies", Named(&Object(BODY_LOAD)), "{}", "What is done to which body, by name."),
            Key::optional(
                "gravity",
                ACCELERATION_VECTOR,
                "Gravity at the end of the stage; without it, as before.",
            ),
        ],
    },
];

const FREE_LENGTH: Form = Nullable(&SIGNED_LENGTH);
const FREE_ANGLE: Form = Nullable(&ANGLE);
const FREE_FORCE: Form = Nullable(&FORCE);
const FREE_MOMENT: Form = Nullable(&MOMENT);

static BODY_LOAD: &[Key] = &[
    Key::optional(
        "displacement",
        Tuple(&[FREE_LENGTH, FREE_LENGTH, FREE_LENGTH]),
        "Displacement of the reference point over this stage; a null component is free.",
    ),
    Key::optional(
        "rotation",
        Tuple(&[FREE_ANGLE, FREE_ANGLE, FREE_ANGLE]),
        "Rotation vector over this stage, space axes; a null component is free.",
    ),
    Key::optional(
        "force",
        Tuple(&[FREE_FORCE, FREE_FORCE, FREE_FORCE]),
        "Force at the end of the stage; null is none given.",
    ),
    Key::optional(
        "moment",
        Tuple(&[FREE_MOMENT, FREE_MOMENT, FREE_MOMENT]),
        "Moment about the reference point at the end of the stage; null is none given.",
    ),
];

static SOLVER: &[Key] = &[
    Key::default(
        "fidelity",
        Choice(&["auto", "rigid", "condensed", "full"]),
        "\"auto\"",
        "How grains deform; auto chooses for each. Where grains of a specimen break, their contacts soften and the sound rock that is left bends.",
    ),
    Key::optional(
        "accuracy",
        Quantity(Dimension::None, positive(1.0)),
        "Relative error of contact forces, and so of q, that fidelity \"auto\" may cause: each body is condensed where it has to be, and where it nears damage. Without it \"auto\" is rigid for all. Increments of driven stages are at most 5e-3 of it in axial strain.",
    ),
    Key::optional(
        "full_nodes",
        Choice(&["eliminated", "unknowns"]),
        "Without effect: the nodes of full bodies are always eliminated body by body.",
    ),
    Key::default("force_tolerance", TOLERANCE, "1e-3", "Out-of-balance force over the mean contact force."),
    Key::default(
        "stabilisation",
        Nullable(&TOLERANCE),
        "3e-3",
        "Mean force out of balance on a body over the mean contact force (the unbalanced force ratio) to which an increment of a specimen is taken; what still moves then goes on moving, against a drag, in the next one, and unrest in the history says how much does. Holds, unloading and, unless a collapse goes on, ends of stages come to rest. null: every increment balances to force_tolerance. Scenes always do.",
    ),
    Key::optional("rough_tolerance", Nullable(&TOLERANCE), "Without effect: see stabilisation."),
    Key::default(
        "gap_tolerance",
        TOLERANCE,
        "1e-5",
        "By how much gaps between bodies that deform and their contact forces may disagree at rest, over the median size of the bodies. 1 % of what a rigid contact yields under the mean contact force counts where it is less, but with damage no less than 1e-6 of that size. Rows that are not at rest may miss it tenfold, those behind asperities whose steps run out by more. Without effect on rigid bodies.",
    ),
    Key::default(
        "first_penalty",
        Quantity(Dimension::None, within(1e-3, 1e3)),
        "1",
        "First penalty of a contact of condensed bodies whose force is no unknown yet, over the bodies' own stiffness there; each adapts, and only the number of augmentations depends on it.",
    ),
    Key::default(
        "max_augmentations",
        Count(1, 100_000),
        "600",
        "Steps in which an increment that has to come to rest does so, or is cut; other increments of specimens take forty at most.",
    ),
    Key::default(
        "max_dwell",
        Count(0, 100_000),
        "300",
        "Steps in which bodies of a scene come to balance that fell a long way, where the smallest increment found none; 0: none fall, it stops there.",
    ),
    Key::default("max_newton_iterations", Count(1, 10_000), "12", "Newton iterations in a step."),
    Key::default(
        "damage_change",
        Quantity(Dimension::None, within(1e-3, 1.0)),
        "0.2",
        "Largest change of damage at an integration point at once: between two augmentations, or in a step that a brittle grain takes by itself.",
    ),
    Key::default(
        "increment_min",
        Quantity(Dimension::None, positive(1.0)),
        "1e-2",
        "Smallest cut of an increment, as a share of the stage's increment.",
    ),
    Key::default(
        "increment_max",
        Quantity(Dimension::None, within(1.0, 1e4)),
        "1",
        "Largest growth of an increment, in stage's increments.",
    ),
    Key::default(
        "increment_growth",
        Quantity(Dimension::None, within(1.0, 10.0)),
        "1.5",
        "Factor on the increment of a specimen after an easy one, up to the largest; in scenes 1.5.",
    ),
    Key::default(
        "energy_gate",
        Nullable(&Form::Either(&[Choice(&["warn", "cut"]), Quantity(Dimension::None, positive(1.0))])),
        "\"warn\"",
        "Whether an increment whose energy closes worse than energy_tolerance is counted (and told of where its stage's sum is not sound) or cut (as far as increment_min lets it); null: neither. A number is a tolerance to count at (the older form).",
    ),
    Key::default(
        "energy_tolerance",
        Quantity(Dimension::None, positive(1.0)),
        "1e-3",
        "Energy error of an increment of a specimen over the larger of the work that ram and pressure exchange in it and what it loses.",
    ),
];

static OUTPUT: &[Key] = &[
    Key::default(
        "fields_every",
        Quantity(Dimension::None, positive(1.0)),
        "0.005",
        "Axial strain between saved states; in stages without strain, the share of the stage.",
    ),
    Key::default("contacts", Flag, "true", "Whether saved states include the contacts."),
    Key::default(
        "restart_every",
        Count(1, 1_000_000),
        "10",
        "Increments between restart points; one is written after 30 s too, and none before 50 times its cost have passed.",
    ),
];
