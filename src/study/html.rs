//! Pages of one file, without scripts, for light and dark screens.

/// Colours as variables, so that drawings follow the screen, too, plots in black on white among them.
const STYLE: &str = ":root{color-scheme:light dark;--back:#fff;--ink:#222;--faint:#8884;--a:#0072b2;--b:#d55e00;--c:#009e73;--d:#cc79a7;--e:#56b4e9;--f:#e69f00}\
@media(prefers-color-scheme:dark){:root{--back:#181a1d;--ink:#ddd}}\
body{font:16px/1.5 system-ui,sans-serif;max-width:960px;margin:2em auto;padding:0 1em;color:var(--ink);background:var(--back)}\
svg{max-width:100%;height:auto}svg.drawn text{font:13px system-ui,sans-serif;fill:var(--ink)}\
svg [fill='#FFFFFF']{fill:var(--back)}svg [fill='#000000']{fill:var(--ink)}svg [stroke='#000000']{stroke:var(--ink)}figure{margin:1em 0}table{border-collapse:collapse;margin:1em 0;font-variant-numeric:tabular-nums}\
td,th{padding:.2em .7em;border-bottom:1px solid var(--faint);text-align:right}td:first-child,th:first-child{text-align:left}.wide{overflow-x:auto}";

/// Returns a whole page.
pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
<title>{0}</title><style>{STYLE}</style></head>\n<body>\n<h1>{0}</h1>\n{body}</body></html>\n",
        escaped(title)
    )
}

/// Returns a table with a row of heads; all cells are texts.
pub fn table<R: AsRef<[String]>>(heads: &[&str], rows: impl IntoIterator<Item = R>) -> String {
    let heads: String = heads.iter().map(|head| format!("<th>{}</th>", escaped(head))).collect();
    let cells =
        |row: R| row.as_ref().iter().map(|cell| format!("<td>{}</td>", escaped(cell))).collect::<String>();
    let rows: String = rows.into_iter().map(|row| format!("<tr>{}</tr>\n", cells(row))).collect();
    format!("<div class=\"wide\"><table><tr>{heads}</tr>\n{rows}</table></div>\n")
}

/// Formats a number with a thin space between thousands.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

/// Escapes a text for use in a page.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_apart() {
        let thin = |n: u64| grouped(n).replace('\u{2009}', " ");
        assert_eq!([0, 999, 1000, 1_234_567].map(thin), ["0", "999", "1 000", "1 234 567"]);
    }

    #[test]
    fn names_of_scenes_cannot_become_markup() {
        let page = document("a <b>", &table(&["x & y"], [["\"<script>\"".to_owned()]]));
        assert!(page.contains("<title>a &lt;b&gt;</title>") && page.contains("<th>x &amp; y</th>"), "{page}");
        assert!(!page.contains("<script"), "{page}");
    }
}
