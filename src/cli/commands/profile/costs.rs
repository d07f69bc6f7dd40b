//! The costs of entities and materials, as tables and as JSON.

use serde_json::{Value, json};

use super::report::visits_json;
use crate::cli::job::rounded_count;
use crate::error::in_one_line;
use crate::study::profile::parts::PartCost;
use crate::study::profile::report::{ProfileReport, percent};

/// The number of rows in a table; the JSON has all.
const SHOWN: usize = 10;

impl ProfileReport<'_> {
    /// Returns the tables of what entities and materials cost.
    pub fn costs(&self) -> Vec<String> {
        let entities = self.costs_in("entity", &self.entities());
        entities.into_iter().chain(self.costs_in("material", &self.materials())).collect()
    }

    fn costs_in(&self, what: &str, costs: &[(String, PartCost)]) -> Vec<String> {
        let all: u64 = costs.iter().map(|(_, cost)| cost.tests()).sum();
        let mut lines = vec![
            String::new(),
            format!(
                "{what:30}{:>10}{:>10}{:>12}{:>9}{:>14}",
                "rays", "shadow", "tests", "of all", "time, about"
            ),
        ];
        for (name, cost) in costs.iter().take(SHOWN) {
            let name: String = in_one_line(name).chars().take(29).collect();
            lines.push(format!(
                "{name:30}{:>10}{:>10}{:>12}{:>9}{:>14}",
                rounded_count(cost.rays),
                rounded_count(cost.shadow),
                rounded_count(cost.tests()),
                percent(cost.tests() as f64 / all.max(1) as f64),
                format!("{:.2} ms", self.flows.parts.seconds(cost, self.stages) * 1e3)
            ));
        }
        let more = costs.len().saturating_sub(SHOWN);
        if more > 0 {
            lines.push(format!("and {more} more"));
        }
        lines
    }

    /// Returns the costs of entities as a JSON list, the highest first.
    pub fn entities_json(&self) -> Value {
        self.costs_json(self.entities())
    }

    /// Returns the costs of materials as a JSON list, the highest first.
    pub fn materials_json(&self) -> Value {
        self.costs_json(self.materials())
    }

    fn costs_json(&self, costs: Vec<(String, PartCost)>) -> Value {
        let row = |(name, cost): (String, PartCost)| {
            json!({
                "name": name, "rays": cost.rays, "shadow": cost.shadow,
                "visits": visits_json(&cost.visits), "shadow_visits": visits_json(&cost.shadow_visits),
                "seconds_about": self.flows.parts.seconds(&cost, self.stages),
            })
        };
        costs.into_iter().map(row).collect()
    }
}
