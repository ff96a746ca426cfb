#include "traceur/optim/state.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "traceur/core/error.h"

namespace traceur::optim {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

std::string sample() {
  StateWriter w("thing", 3);
  w.integer(42);
  w.real(-0.0);
  w.real(std::numeric_limits<double>::denorm_min());
  w.reals(std::vector<double>{1.5, NAN, kInf});
  w.text("why");
  return w.finish();
}

TEST(State, GivesBackEveryBit) {
  const std::string bytes = sample();
  StateReader r(bytes, "thing", 3);
  EXPECT_EQ(r.integer(), 42);
  EXPECT_TRUE(std::signbit(r.real()));
  EXPECT_EQ(r.real(), std::numeric_limits<double>::denorm_min());
  const std::vector<double> reals = r.reals();
  ASSERT_EQ(reals.size(), 3);
  EXPECT_EQ(reals[0], 1.5);
  EXPECT_TRUE(std::isnan(reals[1]));
  EXPECT_EQ(reals[2], kInf);
  EXPECT_EQ(r.text(), "why");
  EXPECT_NO_THROW(r.finish());
}

TEST(State, RefusesWhatIsForeignCutOrDamaged) {
  const std::string bytes = sample();
  EXPECT_THROW(StateReader("", "thing", 3), InputError);
  EXPECT_THROW(StateReader("SQLite format 3", "thing", 3), InputError);
  EXPECT_THROW(StateReader(bytes, "other", 3), InputError);
  EXPECT_THROW(StateReader(bytes, "thing", 4), InputError);
  EXPECT_THROW(StateReader(bytes + "x", "thing", 3), InputError);
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(StateReader(bytes.substr(0, size), "thing", 3), InputError) << size;
  }
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] ^= 0x10;
    EXPECT_THROW(StateReader(damaged, "thing", 3), InputError) << i;
  }
}

TEST(State, RefusesToReadWhatIsNotThere) {
  StateWriter w("thing", 1);
  w.reals(std::vector<double>{1, 2});
  const std::string bytes = w.finish();
  double three[3];
  EXPECT_THROW(StateReader(bytes, "thing", 1).reals(three), InputError);
  StateReader r(bytes, "thing", 1);
  EXPECT_THROW(r.finish(), InputError);
  r.reals();
  EXPECT_THROW(r.integer(), InputError);
  EXPECT_THROW(r.text(), InputError);
  // A count that claims more than there is must not allocate it.
  StateWriter huge("thing", 1);
  huge.integer(UINT64_MAX / 4);
  const std::string lie = huge.finish();
  EXPECT_THROW(StateReader(lie, "thing", 1).reals(), InputError);
  EXPECT_THROW(StateReader(lie, "thing", 1).text(), InputError);
}

TEST(State, SaysWhatIsWrong) {
  try {
    const StateReader reader(sample(), "cma-es", 1);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "cannot restore cma-es: the state is one of \"thing\"");
  }
}

}  // namespace
}  // namespace traceur::optim
