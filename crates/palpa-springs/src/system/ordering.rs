//! The order of elimination: approximate minimum degree for the columns of the body; the nodes of a
//! column stay together.

use palpa_sparse::{NodePattern, minimum_degree};

use crate::constraints::Freedom;
use crate::error::SpringError;
use crate::network::Network;

/// Nodes with unknowns, in the order of elimination. The ordering works on a graph of columns with
/// such nodes, because the connectivity of a layered body is that of its skin.
pub(crate) fn column_order(
    network: &Network,
    freedoms: &[Freedom],
) -> Result<Vec<usize>, SpringError> {
    let n_columns = network.column.iter().max().map_or(0, |c| *c as usize + 1);
    let mut members = vec![Vec::new(); n_columns];
    for (node, freedom) in freedoms.iter().enumerate() {
        if freedom.n_free > 0 {
            members[network.column[node] as usize].push(node);
        }
    }
    // Numbers only the columns that have unknowns.
    let mut rank = vec![usize::MAX; n_columns];
    let taking_part: Vec<usize> = (0..n_columns).filter(|&c| !members[c].is_empty()).collect();
    for (r, &c) in taking_part.iter().enumerate() {
        rank[c] = r;
    }
    let edges = network
        .bars
        .iter()
        .filter(|bar| {
            [bar.a, bar.b]
                .iter()
                .all(|n| freedoms[*n as usize].n_free > 0)
        })
        .map(|bar| {
            let [a, b] = [bar.a, bar.b].map(|n| rank[network.column[n as usize] as usize]);
            (a, b)
        });
    let forward = minimum_degree(taking_part.len(), edges)?;
    Ok(forward
        .into_iter()
        .flat_map(|r| members[taking_part[r]].iter().copied())
        .collect())
}

/// The pattern of free nodes that share a bar.
pub(crate) fn node_pattern(network: &Network, order: &[usize]) -> NodePattern {
    let mut place = vec![usize::MAX; network.n_nodes()];
    for (p, &node) in order.iter().enumerate() {
        place[node] = p;
    }
    let mut pattern: NodePattern = order.iter().map(|&node| (node, Vec::new())).collect();
    for bar in &network.bars {
        let [p, q] = [bar.a, bar.b].map(|n| place[n as usize]);
        if p.max(q) != usize::MAX {
            pattern[p.min(q)].1.push(order[p.max(q)]);
        }
    }
    for (_, later) in &mut pattern {
        later.sort_unstable_by_key(|&node| place[node]);
        later.dedup();
    }
    pattern
}
