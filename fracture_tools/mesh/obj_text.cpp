#include "fracture_tools/mesh/obj_text.h"

namespace sunder {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool ends_line(char c) { return c == '\n' || c == '\r'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

class ObjMender {
public:
    explicit ObjMender(std::string_view text) : text_(text) {}

    std::optional<std::string> run() {
        while (at_ < text_.size()) {
            if (is_blank(here())) leave_out(is_blank);
            if (here() == 'v')
                mend_line();
            else
                pass_line();
        }
        if (copied_ == 0) return {};
        mended_.append(text_.substr(copied_));
        return std::move(mended_);
    }

private:
    char here() const { return at_ < text_.size() ? text_[at_] : '\n'; }
    char before() const { return at_ > 0 ? text_[at_ - 1] : '\n'; }
    char after() const { return at_ + 1 < text_.size() ? text_[at_ + 1] : '\n'; }

    void copy_up_to_here() { mended_.append(text_.substr(copied_, at_ - copied_)), copied_ = at_; }
    template <class Kind>
    void leave_out(Kind is_of_it) {
        copy_up_to_here();
        while (at_ < text_.size() && is_of_it(here())) ++at_;
        copied_ = at_;
    }

    /// To the next line; false where a backslash joins it to this one.
    bool end_line() {
        const bool goes_on = before() == '\\';
        while (at_ < text_.size() && ends_line(here())) ++at_;
        return !goes_on;
    }

    void pass_line() {
        do {
            while (!ends_line(here())) ++at_;
        } while (at_ < text_.size() && !end_line());
    }

    void mend_line() {
        for (++at_; at_ < text_.size(); ++at_) {
            if (ends_line(here()) && end_line()) return;
            if (here() == '.' && is_digit(after()) && (is_blank(before()) || ends_line(before()))) {
                copy_up_to_here();
                mended_.push_back('0');
            } else if (here() == '#') {
                leave_out([](char c) { return !ends_line(c); });  // with a backslash at its end: it joins nothing
                while (at_ < text_.size() && ends_line(here())) ++at_;
                return;
            }
        }
    }

    std::string_view text_;
    size_t at_ = 0, copied_ = 0;  // of `text_`; what lies before it is in `mended_`
    std::string mended_;
};

}  // namespace

std::optional<std::string> mended_obj(std::string_view text) { return ObjMender(text).run(); }

}  // namespace sunder
