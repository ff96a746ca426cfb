#include "traceur/optim/state.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

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

TEST(State, RefusesNumbersOutOfTheirRange) {
  const auto reads = [](auto write, auto read) {
    StateWriter w("thing", 1);
    write(w);
    const std::string bytes = w.finish();
    StateReader r(bytes, "thing", 1);
    try {
      read(r);
      return true;
    } catch (const InputError&) {
      return false;
    }
  };
  const auto integer = [](std::uint64_t v) { return [v](StateWriter& w) { w.integer(v); }; };
  const auto real = [](double v) { return [v](StateWriter& w) { w.real(v); }; };
  const auto three = [](double v) {
    return [v](StateWriter& w) { w.reals(std::vector<double>{1, v, 2}); };
  };
  const auto in_2_5 = [](StateReader& r) { r.integer(2, 5); };
  EXPECT_TRUE(reads(integer(2), in_2_5) && reads(integer(5), in_2_5));
  EXPECT_FALSE(reads(integer(6), in_2_5) || reads(integer(1), in_2_5));
  const auto boolean = [](StateReader& r) { r.boolean(); };
  EXPECT_TRUE(reads(integer(0), boolean) && reads(integer(1), boolean));
  EXPECT_FALSE(reads(integer(2), boolean) || reads(integer(UINT64_MAX), boolean));
  EXPECT_FALSE(reads(integer(1), [](StateReader& r) { r.count(8); })) << "nothing is left";
  EXPECT_FALSE(reads(integer(UINT64_MAX), [](StateReader& r) { r.count(8); }));
  const auto two_words = [](StateWriter& w) { w.integer(2), w.real(1), w.real(2); };
  EXPECT_TRUE(reads(two_words, [](StateReader& r) { EXPECT_EQ(r.count(8), 2u); }));
  EXPECT_FALSE(reads(two_words, [](StateReader& r) { r.count(9); }));
  const double most = std::numeric_limits<double>::max();
  const auto finite = [](StateReader& r) { r.finite(); };
  EXPECT_TRUE(reads(real(most), finite) && reads(real(-most), finite));
  EXPECT_FALSE(reads(real(NAN), finite) || reads(real(kInf), finite) || reads(real(-kInf), finite));
  const auto positive = [](StateReader& r) { r.positive(); };
  EXPECT_TRUE(reads(real(5e-324), positive) && reads(real(most), positive));
  EXPECT_FALSE(reads(real(kInf), positive));
  const auto in_1_2 = [](StateReader& r) { r.real(1, 2); };
  EXPECT_TRUE(reads(real(1), in_1_2) && reads(real(2), in_1_2));
  EXPECT_FALSE(reads(real(0.99), in_1_2) || reads(real(2.01), in_1_2));
  EXPECT_FALSE(reads(real(0), positive) || reads(real(-1), positive) || reads(real(NAN), positive));
  double values[3];
  const auto all_finite = [&](StateReader& r) { r.finite(values); };
  const auto all_positive = [&](StateReader& r) { r.positive(values); };
  EXPECT_TRUE(reads(three(-3), all_finite) && reads(three(3), all_positive));
  EXPECT_FALSE(reads(three(NAN), all_finite) || reads(three(0), all_positive));
}

TEST(State, ReadsNoReasonToStopThatIsNoWord) {
  for (const auto& [reason, good] :
       {std::pair(std::string("no candidates"), true), std::pair(std::string(), false),
        std::pair(std::string("\x1b[2J"), false), std::pair(std::string("tolX"), false),
        std::pair(std::string(40, 'a'), true), std::pair(std::string(41, 'a'), false)}) {
    StateWriter w("thing", 1);
    writeStop(w, Stop{reason, 1, 2});
    const std::string bytes = w.finish();
    StateReader r(bytes, "thing", 1);
    if (good) {
      const std::optional<Stop> stop = readStop(r);
      ASSERT_TRUE(stop);
      EXPECT_EQ(stop->reason, reason);
      EXPECT_EQ(stop->value, 1);
      EXPECT_EQ(stop->limit, 2);
      EXPECT_NO_THROW(r.finish());
    } else {
      EXPECT_THROW(readStop(r), InputError);
    }
  }
}

TEST(State, SaysWhatIsLeft) {
  StateWriter w("thing", 1);
  w.integer(3);
  w.integer(4);
  const std::string bytes = w.finish();
  StateReader r(bytes, "thing", 1);
  EXPECT_EQ(r.integer(), 3u);
  try {
    r.finish();
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "cannot restore thing: 8 bytes too many");
  }
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
