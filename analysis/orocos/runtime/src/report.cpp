#include "report.hpp"

#include <algorithm>
#include <cstdio>

#include "mauve/robot.hpp"

namespace mauve {
namespace {

typedef std::vector<std::string> Cells;

std::string verdict(const Row& row) {
  if (row.has_thrown) return "✗ exception";
  if (row.misses > 0) return "✗ " + std::to_string(row.misses) + " missed";
  if (row.priority == 0) return "background";
  if (row.periods == 0) return "no period ended";
  if (row.bound != no_bound && row.response > row.bound) return "! above its bound";
  return "✓ met";
}

std::string percent(const Row& row) {
  if (row.bound <= 0 || row.periods == 0) return "—";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100.0 * static_cast<double>(row.response) / static_cast<double>(row.bound));
  return text;
}

Cells cells(const Row& row) {
  const bool has_periods = row.periods > 0;
  return {row.instance,
          row.priority == 0 ? "—" : std::to_string(row.priority),
          milliseconds(row.period),
          row.deadline == 0 ? "—" : milliseconds(row.deadline),
          std::to_string(row.periods),
          std::to_string(row.overruns),
          has_periods ? milliseconds(row.latency) : "—",
          has_periods ? milliseconds(row.response) : "—",
          row.bound == no_bound ? "—" : milliseconds(row.bound),
          percent(row),
          verdict(row)};
}

// The number of characters of a text in UTF-8.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

}  // namespace

std::string milliseconds(Nanoseconds time) {
  char text[32];
  std::snprintf(text, sizeof text, "%lld.%03lld", static_cast<long long>(time / 1000000),
                static_cast<long long>(time / 1000 % 1000));
  std::string shown = text;
  while (shown.back() == '0') shown.pop_back();
  if (shown.back() == '.') shown.pop_back();
  return shown;
}

std::string table(const std::vector<Row>& rows) {
  std::vector<Cells> lines{{"instance", "priority", "period", "deadline", "periods", "overruns", "latest start", "response",
                            "bound", "of bound", ""}};
  for (const Row& row : rows) lines.push_back(cells(row));
  std::vector<std::size_t> widths(lines[0].size());
  for (const Cells& line : lines) {
    for (std::size_t column = 0; column < line.size(); ++column) {
      widths[column] = std::max(widths[column], width(line[column]));
    }
  }
  std::string out;
  for (const Cells& line : lines) {
    std::string text = " ";
    for (std::size_t column = 0; column < line.size(); ++column) {
      const std::string space(widths[column] - width(line[column]), ' ');
      // Names and verdicts begin, numbers end at the same place.
      const bool is_left = column == 0 || column + 1 == line.size();
      text += " " + (is_left ? line[column] + space : space + line[column]) + (column + 1 == line.size() ? "" : " ");
    }
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + "\n";
  }
  return out;
}

}  // namespace mauve
