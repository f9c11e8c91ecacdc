#include "nodes/graph/strict_json.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

namespace sunder {
namespace {

constexpr size_t kDeepest = 64;

/// Builds the document event by event, because the library's own builder lets the last of two equal keys win.
class Builder : public nlohmann::json_sax<Json> {
public:
    Builder(std::string_view text, const std::string& where) : text_(text), where_(where) {}

    Json take() { return std::move(root_); }
    const Error& error() const { return error_; }

    bool null() override { return place(nullptr); }
    bool boolean(bool value) override { return place(value); }
    bool number_integer(number_integer_t value) override { return place(value); }
    bool number_unsigned(number_unsigned_t value) override { return place(value); }
    bool number_float(number_float_t value, const string_t&) override { return place(value); }
    bool string(string_t& value) override { return place(std::move(value)); }
    bool binary(binary_t&) override { return false; }
    bool start_object(size_t) override { return open(Json::object()); }
    bool start_array(size_t) override { return open(Json::array()); }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }

    bool key(string_t& value) override {
        Level& level = levels_.back();
        level.key = value;
        if (level.keys.insert(value).second) return true;
        error_ = bad_input(where_, "the key " + path() + " appears twice", "remove one of them");
        return false;
    }

    bool parse_error(size_t position, const std::string&, const nlohmann::detail::exception& fault) override {
        const std::string_view before = text_.substr(0, std::min(position ? position - 1 : 0, text_.size()));
        const size_t line = 1 + static_cast<size_t>(std::count(before.begin(), before.end(), '\n'));
        const size_t line_start = before.rfind('\n');
        const size_t column = before.size() - (line_start == std::string_view::npos ? 0 : line_start + 1) + 1;
        const std::string place = "line " + std::to_string(line) + ", column " + std::to_string(column);
        const std::string_view message = fault.what();
        if (fault.id == 406)
            error_ = bad_input(where_, "a number is too large to be finite at " + place);
        else if (position >= text_.size() && message.find("unexpected end of input") != std::string_view::npos)
            error_ = bad_input(where_, "the JSON text ends too early, at " + place, "it may have been cut off");
        else
            error_ = bad_input(where_, "not valid JSON at " + place + detail_of(message));
        return false;
    }

private:
    struct Level {
        Json* container;
        std::string key;  // last one seen, of an object
        std::set<std::string, std::less<>> keys;
    };

    /// The library's "[json.exception...] parse error at line 1, column 2: WHY; ..." from WHY on.
    static std::string detail_of(std::string_view message) {
        const size_t column = message.find("column");
        const size_t colon = column == std::string_view::npos ? column : message.find(": ", column);
        return colon == std::string_view::npos ? "" : std::string(message.substr(colon));
    }

    std::string path() const {
        std::string text;
        for (const Level& level : levels_)
            if (!level.key.empty()) text += (text.empty() ? "" : ".") + level.key;
        return "'" + text + "'";
    }

    Json* insert(Json value) {
        if (levels_.empty()) {
            root_ = std::move(value);
            return &root_;
        }
        Json& container = *levels_.back().container;
        if (container.is_array()) {
            container.push_back(std::move(value));
            return &container.back();
        }
        // Straight into the map's vector: its own insertion searches all keys, which are known to be new.
        auto& object = container.get_ref<Json::object_t&>();
        object.emplace_back(levels_.back().key, std::move(value));
        return &object.back().second;
    }

    bool place(Json value) {
        insert(std::move(value));
        return true;
    }

    bool open(Json container) {
        if (levels_.size() == kDeepest) {
            error_ = bad_input(where_, "lists and objects are nested deeper than " + std::to_string(kDeepest) +
                                           " levels at " + path());
            return false;
        }
        Json* const opened = insert(std::move(container));
        levels_.push_back({opened, {}, {}});
        return true;
    }

    bool close() {
        levels_.pop_back();
        return true;
    }

    std::string_view text_;
    const std::string& where_;
    Json root_;
    std::vector<Level> levels_;
    Error error_;
};

}  // namespace

Result<Json> parse_json(std::string_view text, const std::string& where) {
    Builder builder(text, where);
    try {
        if (!Json::sax_parse(text.begin(), text.end(), &builder)) return builder.error();
    } catch (const std::exception& e) {
        return bad_input(where, std::string("not readable as JSON: ") + e.what());
    }
    return builder.take();
}

}  // namespace sunder
