// sunder report: what broke in a bake, when and why, and what its fragments bore.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <tuple>

#include "nodes/break_report.h"
#include "nodes/graph/json.h"
#include "plugin_src/cli/commands.h"
#include "plugin_src/cli/report.h"

namespace sunder::cli {
namespace {

constexpr size_t kMostRows = 40;  // of a table that a person reads

struct ReportOptions {
    std::string bake, fragments, body, group;
    std::vector<double> box;
    std::optional<int32_t> cluster;
    bool as_json = false;
};

bool take_number(std::string_view& io_text, uint32_t& o_number) {
    const auto [stop, code] = std::from_chars(io_text.data(), io_text.data() + io_text.size(), o_number);
    if (code != std::errc()) return false;
    io_text.remove_prefix(static_cast<size_t>(stop - io_text.data()));
    return true;
}

// "3,7-9": numbers and ranges.
Result<std::vector<uint32_t>> to_numbers(const std::string& text) {
    constexpr uint32_t kMost = 10'000'000;
    const Error fault =
        bad_usage("--fragments '" + text + "' names no fragments", "give all, or numbers and ranges as 3,7-9");
    std::vector<uint32_t> numbers;
    for (std::string_view rest = text;;) {
        uint32_t first = 0, last = 0;
        if (!take_number(rest, first)) return fault;
        last = first;
        if (rest.starts_with('-')) {
            rest.remove_prefix(1);
            if (!take_number(rest, last)) return fault;
        }
        if (last < first || last > kMost) return fault;
        for (uint32_t n = first; n <= last; ++n) numbers.push_back(n);
        if (rest.empty()) return numbers;
        if (!rest.starts_with(',')) return fault;
        rest.remove_prefix(1);
    }
}

Result<FragmentChoice> choice_of(const ReportOptions& options) {
    FragmentChoice choice;
    choice.body = options.body;
    choice.group = options.group;
    choice.cluster = options.cluster;
    if (options.fragments == "all") {
        choice.all = true;
    } else if (!options.fragments.empty()) {
        auto numbers = to_numbers(options.fragments);
        if (!numbers) return numbers.error();
        choice.fragments = numbers.take();
    }
    if (!options.box.empty()) {
        choice.box.emplace();
        choice.box->extend({options.box[0], options.box[1], options.box[2]});
        choice.box->extend({options.box[3], options.box[4], options.box[5]});
    }
    if (!choice.body.empty() && choice.is_empty()) choice.all = true;
    return choice;
}

std::string name_of(const LoggedBreak& b) {
    switch (b.by_kind) {
        case Pusher::Kind::nothing:
            return "nothing";
        case Pusher::Kind::particle:
            return b.by == b.body ? "its own piece " + std::to_string(b.by_fragment)
                                  : b.by + " (fragment " + std::to_string(b.by_fragment) + ")";
        case Pusher::Kind::seam:
            return "seam " + b.by;
        default:
            return b.by;
    }
}

// Of one frame and body, what one thing broke.
struct Group {
    size_t n = 0;
    Vec3 sum = Vec3::Zero();
    const LoggedBreak* first = nullptr;
    const LoggedBreak* worst = nullptr;  // for its toughness

    void add(const LoggedBreak& b) {
        const auto share = [](const LoggedBreak& at) {
            return at.toughness > 0 ? std::abs(at.strain) / at.toughness : 0;
        };
        ++n, sum += b.position;
        if (!first || b.time < first->time) first = &b;
        if (!worst || share(b) > share(*worst)) worst = &b;
    }
};

void print_breaks(const BreakReport& report) {
    std::vector<std::pair<int, Group>> rows;
    for (const FrameBreaks& frame : report.breaks) {
        std::map<std::tuple<std::string, int, std::string>, Group> groups;
        for (const LoggedBreak& b : frame.edges) {
            const bool is_own = b.by_kind == Pusher::Kind::particle && b.by == b.body;
            groups[{b.body, static_cast<int>(b.by_kind), is_own ? "" : b.by}].add(b);
        }
        std::vector<Group> of_frame;
        for (const auto& [unused, group] : groups) of_frame.push_back(group);
        std::ranges::stable_sort(of_frame, {}, [](const Group& g) { return g.first->time; });
        for (const Group& group : of_frame) rows.emplace_back(frame.frame, group);
    }
    std::printf("%6s %9s %6s  %-16s %-24s %9s %9s  %s\n", "frame", "time s", "edges", "body", "where m", "strain",
                "toughness", "pushed by");
    for (size_t i = 0; i < std::min(rows.size(), kMostRows); ++i) {
        const auto& [frame, group] = rows[i];
        const Vec3 at = group.sum / static_cast<double>(group.n);
        char where[80];
        std::snprintf(where, sizeof where, "%.3g %.3g %.3g", at.x(), at.y(), at.z());
        std::printf("%6d %9.4f %6zu  %-16s %-24s %9.4g %9.4g  %s\n", frame, group.first->time, group.n,
                    group.first->body.c_str(), where, group.worst->strain, group.worst->toughness,
                    name_of(*group.worst).c_str());
    }
    if (rows.size() > kMostRows) std::printf("... and %zu rows more (--json has all)\n", rows.size() - kMostRows);
}

void print_pieces(const BreakReport& report) {
    std::printf("\n%6s %7s  %s\n", "frame", "pieces", "fragments of the largest");
    const size_t n = report.breaks.size();
    for (size_t i = n > kMostRows ? n - kMostRows : 0; i < n; ++i) {
        const FrameBreaks& frame = report.breaks[i];
        std::string sizes;
        for (const uint32_t size : frame.largest) sizes += (sizes.empty() ? "" : ", ") + std::to_string(size);
        std::printf("%6d %7zu  %s\n", frame.frame, frame.n_pieces, sizes.c_str());
    }
}

void print_cracks(const BreakReport& report) {
    for (const CrackReport& of : report.cracks) {
        const Cracks& c = of.cracks;
        std::printf("\ncracks of %s: %.4g m2 between pieces, %.4g m2 faded within them; they took %.4g J",
                    of.solver.c_str(), c.parted_area, c.faded_area, c.taken);
        if (of.from)
            std::printf(" from frame %d on", *of.from);
        else if (c.broken_work && c.surface_work > 0)
            std::printf(", %.2f times their fracture energy", c.taken / c.surface_work);
        std::printf("\n");
    }
}

void print_fragments(const BreakReport& report) {
    std::vector<const FragmentReport*> rows;
    for (const FragmentReport& f : report.fragments) rows.push_back(&f);
    std::ranges::stable_sort(rows, std::greater(), [](const FragmentReport* f) { return f->load.share(); });
    std::printf("\n%-16s %8s %9s %9s %7s %6s  %s\n", "body", "fragment", "strain", "toughness", "share", "frame",
                "edges broken");
    for (size_t i = 0; i < std::min(rows.size(), kMostRows); ++i) {
        const FragmentReport& f = *rows[i];
        std::string broken = "none";
        if (f.n_broken > 0) {
            char text[64];
            std::snprintf(text, sizeof text, "%zu, the first at %.4f s", f.n_broken, f.first_broken);
            broken = text;
        }
        std::printf("%-16s %8u %9.4g %9.4g %6.1f%% %6d  %s\n", f.body.c_str(), f.load.fragment, f.load.strain,
                    f.load.toughness, 100 * f.load.share(), f.load.frame, broken.c_str());
    }
    if (rows.size() > kMostRows) std::printf("... and %zu fragments more (--json has all)\n", rows.size() - kMostRows);
}

int run_report(const ReportOptions& options) {
    const auto choice = choice_of(options);
    if (!choice) return fail(choice.error(), "sunder report");
    const auto report = break_report(options.bake, *choice);
    if (!report) return fail(report.error(), options.bake);
    if (options.as_json) {
        std::printf("%s\n", to_json(*report).dump(1, ' ', false, Json::error_handler_t::replace).c_str());
        return kDone;
    }
    std::printf("%s: frames %d to %d%s, %zu edges broken\n", options.bake.c_str(), report->frames[0], report->frames[1],
                report->is_complete ? "" : " (not complete)", report->n_broken());
    if (!report->note.empty()) std::printf("note: %s\n", report->note.c_str());
    if (const LoggedBreak* first = report->first()) {
        std::printf("first: %s at %.4f s, edge %u between fragments %u and %u", first->body.c_str(), first->time,
                    first->edge, first->fragments[0], first->fragments[1]);
        if (first->by_kind == Pusher::Kind::seam)
            std::printf(", told to by %s\n\n", name_of(*first).c_str());
        else
            std::printf(": strain %.4g of %.4g, pushed by %s\n\n", first->strain, first->toughness,
                        name_of(*first).c_str());
        print_breaks(*report);
        print_pieces(*report);
    }
    print_cracks(*report);
    if (!report->fragments.empty()) print_fragments(*report);
    return kDone;
}

}  // namespace

void add_report_command(CLI::App& app, Run& out_run) {
    auto options = std::make_shared<ReportOptions>();
    CLI::App* command = app.add_subcommand("report", "Tell what broke in a bake, when and why, and what did not");
    command->add_option("BAKE", options->bake, "bake folder, complete or not")->required();
    command->add_flag("--json", options->as_json, "as JSON, with every edge");
    command
        ->add_option("--fragments", options->fragments,
                     "tell the largest load of these fragments, whether they broke or not: all, or as 3,7-9")
        ->type_name("NUMBERS");
    command->add_option("--body", options->body, "of this body alone")->type_name("NAME");
    command->add_option("--box", options->box, "of the fragments whose centres lie here at the start, m")
        ->expected(6)
        ->type_name("X Y Z X Y Z");
    command->add_option("--group", options->group, "of the fragments that own vertices of this vertex group")
        ->check([](const std::string& name) { return std::string(name.empty() ? "names no vertex group" : ""); })
        ->type_name("NAME");
    command->add_option("--cluster", options->cluster, "of the fragments of this cluster")->type_name("NUMBER");
    command->callback([options, &out_run] { out_run = [options] { return run_report(*options); }; });
}

}  // namespace sunder::cli
