#include "report.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <utility>

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

std::string percent(Nanoseconds observed, Nanoseconds bound) {
  if (bound <= 0 || observed < 0) return "—";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100.0 * static_cast<double>(observed) / static_cast<double>(bound));
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
          percent(has_periods ? row.response : -1, row.bound),
          verdict(row)};
}

Cells cells(const ObservedChain& chain, Nanoseconds begin) {
  const bool is_observed = chain.greatest() >= 0;
  const bool is_late = chain.limit > 0 && chain.greatest() > chain.limit;
  const bool is_above = chain.bound != no_bound && chain.greatest() > chain.bound;
  const std::string fine = chain.bound == no_bound ? "no bound" : "✓";
  return {chain.name,
          is_observed ? milliseconds(chain.greatest()) : "—",
          is_observed ? milliseconds(chain.at() - begin) : "—",
          chain.bound == no_bound ? "—" : milliseconds(chain.bound),
          percent(chain.greatest(), chain.bound),
          !is_observed ? "not observed" : is_late ? "✗ above its limit of " + milliseconds(chain.limit) : is_above ? "! above its bound" : fine};
}

// Less is in no bound either, and delays nobody noticeably.
constexpr Nanoseconds least_work = 100000;
constexpr Nanoseconds least_access = 20000;

Nanoseconds work_per_second(const Work& work, Nanoseconds length) {
  return length <= 0 ? 0 : static_cast<Nanoseconds>(1e9 * static_cast<double>(work.cpu) / static_cast<double>(length));
}

// In milliseconds, with two significant digits, rounded up: somebody copies it into a table.
std::string two_digits(Nanoseconds time) {
  Nanoseconds unit = 1000;
  while (time > 100 * unit) unit *= 10;
  return milliseconds((time + unit - 1) / unit * unit);
}

// Why the instance of this row responded later than its bound. Without a recording, only a wait of its own that is as long as it is late
// is known to have delayed it: `mauve trace check` looks at that period, and knows what else was executed in it.
std::string reason(std::size_t row, const Row& late, const Causes& causes) {
  if (!causes.trace_folder.empty()) return "`mauve trace check " + causes.trace_folder + "` says why";
  for (const CodelRow& it : causes.codels) {
    if (it.instance != row || it.statistics.wait < late.response - late.bound) continue;
    return std::string("codel `") + it.statistics.codel + "` waited for up to " + milliseconds(it.statistics.wait) + " ms";
  }
  return "record it with `--trace DIR`, and `mauve trace check DIR` says why";
}

// The number of characters of a text in UTF-8.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

// In columns.
std::string aligned(const std::vector<Cells>& lines) {
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

std::string explanation(const std::vector<Row>& rows, const Causes& causes) {
  std::string out;
  // Instances of one component have the same keys: a table has each once, with the greatest.
  std::map<std::string, std::pair<Nanoseconds, std::int64_t>> waits;
  std::map<std::string, Nanoseconds> accesses, known;
  for (std::size_t index = 0; index < rows.size(); ++index) {
    const Row& row = rows[index];
    if (row.bound == no_bound || row.response <= row.bound || row.priority == 0) continue;
    out += "  " + row.instance + " responded after " + milliseconds(row.response) + " ms, later than its bound of " +
           milliseconds(row.bound) + " ms: " + reason(index, row, causes) + "\n";
  }
  for (const CodelRow& it : causes.codels) {
    const std::string of = std::string("  codel ") + it.statistics.codel + " of " + rows[it.instance].instance;
    if (it.statistics.wait > std::max<Nanoseconds>(it.wait, 0)) {
      known[it.statistics.codel] = it.wait;
      out += of + " waited for something in " + std::to_string(it.statistics.waits) + " executions, and was off the CPU for up to " +
             milliseconds(it.statistics.wait) + " ms\n";
      auto& wait = waits[it.statistics.codel];
      wait = {std::max(wait.first, it.statistics.wait), std::max(wait.second, it.statistics.times)};
    }
    if (it.statistics.blocked > 0) {
      out += of + " waited for locks for up to " + milliseconds(it.statistics.blocked) + " ms\n";
    }
    if (it.time >= 0 && it.statistics.execution > it.time) {
      out += of + " took up to " + milliseconds(it.statistics.execution) + " ms of CPU time, longer than its " +
             milliseconds(it.time) + " ms in the timing tables\n";
    }
  }
  for (const PortRow& it : causes.ports) {
    if (it.statistics.greatest < least_access || it.statistics.greatest <= it.time) continue;
    known[it.statistics.port] = it.time;
    out += std::string("  port ") + it.statistics.port + " of " + rows[it.instance].instance + " took up to " +
           milliseconds(it.statistics.greatest) + " ms\n";
    Nanoseconds& access = accesses[it.statistics.port];
    access = std::max(access, it.statistics.greatest);
  }
  if (!waits.empty() || !accesses.empty()) {
    out += "  a bound counts waits and ports as a timing table has them; for a table in ms, with what preemption adds to waits\n"
           "  (`mauve trace import` of a recording leaves it out):\n";
  }
  const auto line = [&](const std::string& key, const std::string& value) {
    const std::string instead = known[key] < 0 ? "" : "   # replaces " + milliseconds(known[key]);
    out += "    \"" + key + "\" = " + value + instead + "\n";
  };
  if (!waits.empty()) out += "    [wait]\n";
  for (const auto& it : waits) line(it.first, "{ time = " + two_digits(it.second.first) + ", waits = " + std::to_string(it.second.second) + " }");
  if (!accesses.empty()) out += "    [access]\n";
  for (const auto& it : accesses) line(it.first, two_digits(it.second));
  for (const Work& it : causes.work) {
    const Nanoseconds per_second = work_per_second(it, causes.length);
    if (per_second < least_work) continue;
    out += "  threads named " + it.name + ", which are not instances, used " + milliseconds(per_second) +
           " ms of CPU time per second: no bound counts it; describe it as [[platform.other]] in mauve.toml\n";
  }
  return out;
}

std::string table(const std::vector<Row>& rows) {
  std::vector<Cells> lines{{"instance", "priority", "period", "deadline", "periods", "overruns", "latest start", "response",
                            "bound", "of bound", ""}};
  for (const Row& row : rows) lines.push_back(cells(row));
  return aligned(lines);
}

std::string table(const std::vector<ObservedChain>& chains, Nanoseconds begin) {
  if (chains.empty()) return "";
  std::vector<Cells> lines{{"chain", "observed", "at", "bound", "of bound", ""}};
  for (const ObservedChain& chain : chains) lines.push_back(cells(chain, begin));
  return "chains: the greatest time from a change to the end of its effect, in ms\n" + aligned(lines);
}

}  // namespace mauve
