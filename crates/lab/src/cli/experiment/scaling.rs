//! `mrol-lab experiment scaling`: measures the cost of a look-up against the size of the map.

use std::fmt::{self, Display};
use std::path::PathBuf;

use serde::Serialize;

use crate::cli::bench::workload::{MapOptions, times};
use crate::measure::lookup::compare;
use crate::report::chart::{Axis, Curve, Panel, Scale, Style, panels};
use crate::report::{Table, folder};
use crate::rivals::{Structure, StructureName};
use crate::workload::{Order, Site, Workload};
use mrol::console::error::CliError;
use mrol::console::map_report::{count, percent};
use mrol::console::output::Output;
use mrol_map::map::MultiResolutionMap;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment scaling --out results/
  mrol-lab experiment scaling --out results/ --sizes 10000,1000000 --json

Rolling terrain of 0.1 m, asked near its surface at random and as a spinning sensor sees it; see `mrol-lab bench lookup`
for how. Sizes are voxels, about. Writes scaling.svg, scaling.csv and scaling.md. Needs about 2 GB of memory for 50
million voxels, most of it for the hash set.";

/// The structures that are compared: those that can be this large.
const STRUCTURES: [StructureName; 3] = [StructureName::Bloom, StructureName::Exact, StructureName::Hashset];
const ORDERS: [Order; 2] = [Order::Random, Order::Scan];

/// Cost of a look-up against the size of the map, 10 thousand to 50 million voxels: a plot and a table
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Scaling {
    /// Where to write scaling.svg, scaling.csv and scaling.md; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Sizes of the map, voxels, separated by commas
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = clap::value_parser!(u64).range(Site::VOXELS_RANGE),
          default_values = ["10000", "30000", "100000", "300000", "1000000", "3000000", "10000000", "25000000", "50000000"])]
    sizes: Vec<u64>,
    /// Points of a pass
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    points: u32,
    /// Passes over all points
    #[arg(long, value_name = "N", default_value = "7", value_parser = times)]
    repeats: usize,
    /// Seed of terrain and points
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

impl Scaling {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        folder(&self.out)?;
        output.say(Line::HEAD)?;
        let mut lines = Vec::new();
        for &size in &self.sizes {
            lines.extend(self.measure(size as usize, output)?);
        }
        self.write(&lines)
    }

    /// Measures all structures and orders at one size.
    fn measure(&self, size: usize, output: &Output) -> Result<Vec<Line>, CliError> {
        let site = Workload::Site(Site::of(size, self.seed));
        let map = self.map.map_of(site)?;
        let structures = build(&map)?;
        let mut lines = Vec::new();
        for order in ORDERS {
            let queries = site.queries(order, self.points as usize, self.seed.wrapping_add(1));
            let measured = compare(&structures, &map, 0, &queries, self.repeats).map_err(CliError::failed)?;
            for measured in measured {
                let absent = measured.points - (measured.occupied - measured.false_positives);
                lines.push(Line {
                    voxels: map.voxels(0),
                    order: name_of(order),
                    structure: measured.name.as_str(),
                    ns_per_point: measured.runs.median(),
                    false_positive_rate: measured.false_positives as f64 / absent.max(1) as f64,
                });
                lines.last().map_or(Ok(()), |line| output.print(line))?;
            }
        }
        Ok(lines)
    }

    fn write(&self, lines: &[Line]) -> Result<(), CliError> {
        let mut csv = Table::new(["voxels", "order", "structure", "ns_per_point", "false_positive_rate"]);
        for Line { voxels, order, structure, ns_per_point, false_positive_rate } in lines {
            let (ns, rate) = (format!("{ns_per_point:.3}"), format!("{false_positive_rate:.5}"));
            csv.push([&voxels.to_string(), *order, structure, &ns, &rate]);
        }
        csv.write_csv(&self.out.join("scaling.csv"))?;
        let curves: Vec<Curve> = ORDERS.iter().flat_map(|order| of_order(lines, *order)).collect();
        markdown(&curves).write_markdown(&self.out.join("scaling.md"))?;
        let panel = Panel {
            title: "Time to look up a point of a site of 0.1 m, one core".into(),
            x: Axis { name: "voxels", scale: Scale::Logarithmic },
            y: Axis { name: "ns a point", scale: Scale::Linear },
            curves,
        };
        Ok(panels(&self.out.join("scaling.svg"), &[panel])?)
    }
}

/// A structure with its name.
type Named<'a> = (StructureName, Box<dyn Structure + 'a>);

fn build(map: &MultiResolutionMap) -> Result<Vec<Named<'_>>, CliError> {
    let build = |name: StructureName| Ok((name, name.build(map, 0).map_err(CliError::failed)?));
    STRUCTURES.into_iter().map(build).collect()
}

fn name_of(order: Order) -> &'static str {
    match order {
        Order::Random => "random",
        Order::Scan => "scan",
        Order::Sweep => "sweep",
    }
}

/// A curve for each structure.
fn of_order(lines: &[Line], order: Order) -> impl Iterator<Item = Curve> {
    STRUCTURES.iter().enumerate().map(move |(color, structure)| {
        let (structure, order_name) = (structure.as_str(), name_of(order));
        let own = lines.iter().filter(move |line| line.structure == structure && line.order == order_name);
        Curve {
            name: format!("{structure}, {order_name}"),
            color,
            style: if order == Order::Scan { Style::Dashed } else { Style::Solid },
            points: own.map(|line| (line.voxels as f64, line.ns_per_point)).collect(),
        }
    })
}

/// Table with a row for each size and a column for each curve.
fn markdown(curves: &[Curve]) -> Table {
    let names = curves.iter().map(|curve| curve.name.clone());
    let mut table = Table::new(std::iter::once("voxels".to_owned()).chain(names));
    let sizes = curves.first().map(|curve| curve.points.clone()).unwrap_or_default();
    for (row, (voxels, _)) in sizes.iter().enumerate() {
        let costs = curves.iter().map(|curve| format!("{:.2}", curve.points[row].1));
        table.push(std::iter::once(count(*voxels as usize)).chain(costs));
    }
    table
}

/// The result of one structure, size and order.
#[derive(Serialize)]
struct Line {
    voxels: usize,
    order: &'static str,
    structure: &'static str,
    ns_per_point: f64,
    /// False positive rate among absent voxels.
    false_positive_rate: f64,
}

impl Line {
    const HEAD: &str = "      voxels  order   structure  ns a point  false positives of absent";
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { voxels, order, structure, ns_per_point, false_positive_rate } = self;
        let (voxels, rate) = (count(*voxels), percent(*false_positive_rate));
        write!(f, "{voxels:>12}  {order:<7} {structure:<10} {ns_per_point:>10.2} {rate:>26}")
    }
}
