// Workspaces that are slow to make, lent to whichever thread needs one.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>
#include <vector>

namespace traceur {

/// Makes as many as are in use at once, and no more.
template <class T>
class Lender {
 public:
  using Make = std::function<std::unique_ptr<T>()>;

  explicit Lender(Make make) : make_(std::move(make)) {}

  /// Calls f with one that nobody else has meanwhile. What throws while one is lent loses it.
  template <class F>
  auto with(const F& f) {
    std::unique_ptr<T> lent = take();
    const auto give_back = [&] {
      const std::lock_guard lock(mutex_);
      idle_.push_back(std::move(lent));
    };
    if constexpr (std::is_void_v<decltype(f(*lent))>) {
      f(*lent);
      give_back();
    } else {
      auto result = f(*lent);
      give_back();
      return result;
    }
  }

 private:
  std::unique_ptr<T> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<T> one = std::move(idle_.back());
        idle_.pop_back();
        return one;
      }
    }
    return make_();
  }

  Make make_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

}  // namespace traceur
