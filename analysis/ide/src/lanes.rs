//! Lines between rows, for narrow terminals and windows: each net has a lane at the right of the rows, and an arrow at each row where
//! data arrives.

use std::cmp::Reverse;

use crate::text_canvas::{TextCanvas, cells};

/// The end of a net.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NetEnd {
    pub(crate) row: usize,
    /// The tip of an arrow; none where data leaves.
    pub(crate) tip: Option<&'static str>,
}

/// The columns of a lane.
const LANE: f64 = 2.0;

/// More lanes are not drawn: no terminal shows them.
const MOST_LANES: usize = 1000;

/// The first and the last row of a net, and its ends.
type NetSpan<'a> = (usize, usize, &'a Vec<NetEnd>);

/// Returns the nets of each lane, from left to right; nothing if there are too many lanes.
pub(crate) fn lanes_of<'a>(nets: impl Iterator<Item = &'a Vec<NetEnd>>) -> Option<Vec<Vec<NetSpan<'a>>>> {
    let rows_of = |net: &'a Vec<NetEnd>| net.iter().map(|end| end.row);
    let mut spans: Vec<_> =
        nets.filter_map(|net| Some((rows_of(net).min()?, rows_of(net).max()?, net))).collect();
    // Short ones beside the rows, so that fewer lines cross.
    spans.sort_by_key(|(first, last, _)| (last - first, Reverse(*first)));
    let mut lanes: Vec<Vec<NetSpan<'_>>> = Vec::new();
    for span in spans {
        if lanes.len() > MOST_LANES {
            return None;
        }
        match lanes.iter_mut().find(|lane| lane.iter().all(|it| span.1 < it.0 || it.1 < span.0)) {
            Some(lane) => lane.push(span),
            None => lanes.push(vec![span]),
        }
    }
    Some(lanes)
}

/// Draws rows, with a lane for each net; returns the drawing and its width. Each row has at most one net, so that lines which cross
/// are not connected. Nothing if it is too large.
pub(crate) fn draw_lanes<'a>(
    rows: &[String],
    nets: impl Iterator<Item = &'a Vec<NetEnd>>,
) -> Option<(String, f64)> {
    let left = rows.iter().map(|row| cells(row)).fold(0.0, f64::max) + 2.0;
    let lanes = lanes_of(nets)?;
    let width = left + LANE * lanes.len() as f64;
    let mut canvas = TextCanvas::new(width, rows.len() as f64)?;
    for (lane, spans) in lanes.iter().enumerate() {
        let x = left + LANE * lane as f64;
        for (first, last, net) in spans {
            canvas.line(&[(x, *first as f64), (x, *last as f64)]);
            for end in *net {
                let (y, from) = (end.row as f64, rows.get(end.row).map_or(0.0, |row| cells(row)) + 1.0);
                canvas.line(&[(from, y), (x, y)]);
                canvas.text(from, y, end.tip.unwrap_or("─"));
            }
        }
    }
    for (row, text) in rows.iter().enumerate() {
        canvas.text(0.0, row as f64, text);
    }
    Some((canvas.finish(), width))
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    #[test]
    fn nets_that_do_not_touch_share_a_lane() {
        let rows = ["laser", "  scan", "pilot", "  scan", "  go", "wheels", "  go", "log", "  scan"];
        let end = |row, tip| NetEnd { row, tip };
        let nets =
            [vec![end(1, None), end(3, Some("◂")), end(8, Some("◂"))], vec![end(4, None), end(6, Some("◃"))]];
        let (drawn, width) = draw_lanes(&rows.map(str::to_owned), nets.iter()).unwrap();
        assert_eq!(width, 12.0);
        expect![[r#"
            laser
              scan ───┐
            pilot     │
              scan ◂──┤
              go ───┐ │
            wheels  │ │
              go ◃──┘ │
            log       │
              scan ◂──┘
        "#]]
        .assert_eq(&drawn);
    }
}
