// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TransferTable.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace teravox
{

namespace
{
using Curve = std::function<double(double)>;

void White(double, double* rgb)
{
  rgb[0] = rgb[1] = rgb[2] = 1;
}

// A table as the marcher reads it; the only place here that knows its words.
class View
{
public:
  explicit View(const TransferTable& table)
    : Table(table)
  {
  }

  int Nodes() const { return this->Table.Nodes; }
  double ValueAt(int node) const { return this->Table.Low + node / this->Table.NodesPerUnit; }
  float S(int node) const { return this->Node(node)[2]; }
  float NextS(int node) const { return std::abs(this->Node(node)[3]); }
  // Where behind the node the function jumps, 0..1; NoJump if it doesn't before the next.
  float Jump(int node) const
  {
    float at = 0;
    std::memcpy(&at, &this->Table.Colors[static_cast<std::size_t>(node)][3], sizeof(at));
    EXPECT_EQ(std::signbit(this->Node(node)[3]), at != TransferTable::NoJump);
    return at;
  }
  // The first interval from this one on that isn't zero; interval i ends at node i.
  int Occupied(int interval) const
  {
    return this->Table.Occupied[static_cast<std::size_t>(interval)];
  }
  // Differences of integrals over nodes, in floats and in the order of the shader.
  float Between(int from, int to) const
  {
    const float ofHigh = this->Node(to)[0] - this->Node(from)[0];
    const float ofLow = this->Node(to)[1] - this->Node(from)[1];
    return ofHigh + ofLow;
  }
  // The same in units of data values.
  double Integral(int from, int to) const
  {
    return static_cast<double>(this->Between(from, to)) / this->Table.NodesPerUnit;
  }
  double ColorOf(int node, int channel) const
  {
    return (this->Packed(node, channel) & 0xffffu) / 65535.0;
  }
  double NextColorOf(int node, int channel) const
  {
    return (this->Packed(node, channel) >> 16) / 65535.0;
  }

private:
  const std::array<float, 4>& Node(int node) const
  {
    return this->Table.Integrals[static_cast<std::size_t>(node)];
  }
  std::uint32_t Packed(int node, int channel) const
  {
    return this->Table.Colors[static_cast<std::size_t>(node)][static_cast<std::size_t>(channel)];
  }

  const TransferTable& Table;
};

// A function that is given by its extinction, per world length.
TransferFunction FromExtinction(Curve extinction, std::vector<double> knots, double unit = 1)
{
  TransferFunction function;
  function.Opacity = [extinction, unit](double v) { return -std::expm1(-extinction(v) * unit); };
  function.Color = White;
  function.Knots = std::move(knots);
  function.UnitDistance = unit;
  return function;
}

double Piecewise(const std::vector<double>& knots, const std::vector<double>& values, double v)
{
  const auto above = std::upper_bound(knots.begin(), knots.end(), v);
  if (above == knots.begin())
  {
    return values.front();
  }
  if (above == knots.end())
  {
    return values.back();
  }
  const auto i = static_cast<std::size_t>(above - knots.begin());
  const double f = (v - knots[i - 1]) / (knots[i] - knots[i - 1]);
  return values[i - 1] + f * (values[i] - values[i - 1]);
}

// Many small steps of the midpoint rule: shares nothing with the table.
double Quadrature(const Curve& f, double from, double to, int steps = 200000)
{
  double sum = 0;
  const double h = (to - from) / steps;
  for (int i = 0; i < steps; ++i)
  {
    sum += f(from + (i + 0.5) * h);
  }
  return sum * h;
}

// Closed form of the integral against the table, over random spans of nodes.
void CompareIntegrals(const TransferTable& table, const Curve& antiderivative, double relative)
{
  const View view(table);
  std::mt19937_64 random(5);
  for (int i = 0; i < 2000; ++i)
  {
    int a = static_cast<int>(random() % view.Nodes());
    int b = static_cast<int>(random() % view.Nodes());
    if (a > b)
    {
      std::swap(a, b);
    }
    const double exact = antiderivative(view.ValueAt(b)) - antiderivative(view.ValueAt(a));
    ASSERT_NEAR(view.Integral(a, b), exact, relative * exact + 1e-300)
      << "nodes " << a << " to " << b;
  }
}
} // namespace

TEST(TransferTable, ConstantExtinction)
{
  const auto function = FromExtinction([](double) { return 0.7; }, { 0, 10 });
  const TransferTable table = BuildTransferTable(function, { 0, 10 }, false, 1e-3);
  EXPECT_EQ(table.Low, 0);
  EXPECT_EQ(table.High, 10);
  CompareIntegrals(
    table, [](double v) { return 0.7 * v; }, 1e-6);
}

TEST(TransferTable, LinearExtinction)
{
  for (const double unit : { 1.0, 0.01, 50.0 })
  {
    const auto function =
      FromExtinction([](double v) { return 0.05 + 0.01 * v; }, { -3, 17 }, unit);
    const TransferTable table = BuildTransferTable(function, { -3, 17 }, false, 1e-3);
    CompareIntegrals(
      table, [](double v) { return 0.05 * v + 0.005 * v * v; }, 2e-6);
  }
}

TEST(TransferTable, Box)
{
  const auto inside = [](double v) { return v >= 300 && v <= 400 ? 2.5 : 0.0; };
  const TransferTable table = BuildTransferTable(
    FromExtinction(inside, { 0, 300, 300, 400, 400, 1000 }), { 0, 1000 }, false, 1e-3);
  const View view(table);
  const double interval = 1 / table.NodesPerUnit;
  // A jump is spread over one interval at each side.
  EXPECT_NEAR(view.Integral(0, view.Nodes() - 1), 250, 2.5 * interval);
  const auto node = [&](double v)
  { return static_cast<int>(std::lround((v - table.Low) * table.NodesPerUnit)); };
  EXPECT_EQ(view.Between(0, node(300 - interval * 2)), 0.0f);
  EXPECT_EQ(view.Between(node(400 + interval * 2), view.Nodes() - 1), 0.0f);
  EXPECT_NEAR(view.Integral(node(310), node(390)), 2.5 * 80, 2.5 * interval);
}

TEST(TransferTable, ANarrowPeakIsNotMissed)
{
  // 1/4096 of the range, anywhere.
  for (const double centre : { 0.1234567, 0.5, 0.77777 })
  {
    constexpr double half = 0.5 / 4096;
    const auto peak = [centre](double v)
    { return 3 * std::max(0.0, 1 - std::abs(v - centre) / half); };
    const TransferTable table = BuildTransferTable(
      FromExtinction(peak, { 0, centre - half, centre, centre + half, 1 }), { 0, 1 }, false, 1e-3);
    const View view(table);
    EXPECT_NEAR(view.Integral(0, view.Nodes() - 1), 3 * half, 0.02 * 3 * half) << centre;
  }
}

TEST(TransferTable, ManyKnots)
{
  std::mt19937_64 random(77);
  std::vector<double> knots;
  std::vector<double> values;
  for (int i = 0; i <= 300; ++i)
  {
    knots.push_back(i + (i % 300 == 0 ? 0 : 0.3 * static_cast<double>(random() % 1000) / 1000));
    values.push_back(random() % 3 == 0 ? 0 : static_cast<double>(random() % 1000) / 1200);
  }
  TransferFunction function;
  function.Opacity = [&](double v) { return Piecewise(knots, values, v); };
  function.Color = White;
  function.Knots = knots;
  const TransferTable table = BuildTransferTable(function, { 0, 300 }, false, 1e-3);
  const View view(table);
  const auto extinction = [&](double v) { return -std::log1p(-function.Opacity(v)); };
  for (int i = 0; i < 20; ++i)
  {
    const int a = static_cast<int>(random() % view.Nodes());
    const int b = static_cast<int>(random() % view.Nodes());
    const double exact =
      Quadrature(extinction, view.ValueAt(std::min(a, b)), view.ValueAt(std::max(a, b)));
    EXPECT_NEAR(view.Integral(std::min(a, b), std::max(a, b)), exact, 1e-3 * exact + 1e-3);
  }
}

TEST(TransferTable, WallsLetNothingPassInTheSmallestStep)
{
  for (const double smallestStep : { 1e-6, 1e-3, 10.0 })
  {
    TransferFunction function;
    function.Opacity = [](double v) { return v >= 128 ? 1.0 : 0.25; };
    function.Color = White;
    function.Knots = { 0, 128, 128, 255 };
    function.UnitDistance = 2;
    const TransferTable table = BuildTransferTable(function, { 0, 255 }, true, smallestStep);
    const View view(table);
    EXPECT_LT(std::exp(-table.WallExtinction * smallestStep), 1e-16);
    for (int i = 0; i < view.Nodes(); ++i)
    {
      const double expected = view.ValueAt(i) >= 128
        ? table.WallExtinction
        : std::min(-std::log1p(-0.25) / 2, table.WallExtinction);
      ASSERT_NEAR(static_cast<double>(view.S(i)), expected, 1e-6 * expected);
      ASSERT_EQ(view.NextS(i), view.S(std::min(i + 1, view.Nodes() - 1)));
    }
  }
}

TEST(TransferTable, TheDomainIsWhereDataAndFunctionMeet)
{
  const auto ramp = [](double v) { return 0.001 * std::clamp(v, 0.0, 1000.0); };
  const auto build = [&](const ValueRange& data) {
    return BuildTransferTable(FromExtinction(ramp, { 0, 1000 }), data, false, 1e-3);
  };
  const TransferTable part = build({ 200, 300 });
  EXPECT_EQ(part.Low, 200);
  EXPECT_EQ(part.High, 300);
  CompareIntegrals(
    part, [](double v) { return 0.0005 * v * v; }, 2e-6);
  const TransferTable wide = build({ -1e6, 1e6 });
  EXPECT_EQ(wide.Low, 0);
  EXPECT_EQ(wide.High, 1000);
  const TransferTable unknown = build(ValueRange::Unknown());
  EXPECT_EQ(unknown.Low, 0);
  EXPECT_EQ(unknown.High, 1000);
  // Beyond the function's end it is constant; all values meet that constant.
  for (const ValueRange& data : { ValueRange{ 2000, 3000 }, ValueRange{ -50, -20 },
         ValueRange{ 1e30, 2e30 }, ValueRange{ -2e30, -1e30 } })
  {
    const TransferTable outside = build(data);
    const View view(outside);
    ASSERT_GE(view.Nodes(), 2);
    ASSERT_LT(outside.Low, outside.High);
    for (int i = 0; i < view.Nodes(); ++i)
    {
      ASSERT_NEAR(static_cast<double>(view.S(i)), data.Min > 0 ? 1.0 : 0.0, 1e-6);
    }
  }
  // One value, no knots, nothing known.
  for (const bool known : { false, true })
  {
    const TransferTable constant =
      BuildTransferTable(FromExtinction([](double) { return 0.5; }, {}),
        known ? ValueRange{ 7, 7 } : ValueRange::Unknown(), false, 1e-3);
    EXPECT_TRUE(std::isfinite(constant.NodesPerUnit));
    CompareIntegrals(
      constant, [](double v) { return 0.5 * v; }, 1e-5);
  }
  const TransferTable nothing = build(ValueRange::Void());
  EXPECT_LT(nothing.Low, nothing.High);
}

// A function that isn't clamped jumps at its ends; what lies beyond has to be in the outermost
// nodes.
TEST(TransferTable, FunctionThatIsZeroBeyondItsEnds)
{
  TransferFunction function =
    FromExtinction([](double v) { return v >= 30 && v <= 90 ? 0.5 : 0.0; }, { 30, 90 });
  function.IsConstantBeyond = false;
  for (const bool integers : { false, true })
  {
    for (const ValueRange& data : { ValueRange{ 0, 255 }, ValueRange{ 50, 255 },
           ValueRange{ 0, 60 }, ValueRange{ 100, 255 }, ValueRange::Unknown() })
    {
      const TransferTable table = BuildTransferTable(function, data, integers, 1e-3);
      const View view(table);
      const double last = data.IsKnown() ? data.Max : 1e9;
      const double first = data.IsKnown() ? data.Min : -1e9;
      EXPECT_NEAR(static_cast<double>(view.S(0)), first < 30 || first > 90 ? 0.0 : 0.5, 1e-6);
      EXPECT_NEAR(
        static_cast<double>(view.S(view.Nodes() - 1)), last < 30 || last > 90 ? 0.0 : 0.5, 1e-6);
    }
  }
}

TEST(TransferTable, IntegersLieOnNodes)
{
  for (const ValueRange& data : { ValueRange{ 0, 255 }, ValueRange{ -128, 127 },
         ValueRange{ 0, 65535 }, ValueRange{ -32768, 32767 }, ValueRange{ 17, 1234 } })
  {
    const auto function = FromExtinction([](double) { return 0.1; }, { data.Min, 19, data.Max });
    const TransferTable table = BuildTransferTable(function, data, true, 1e-3);
    ASSERT_EQ(table.NodesPerUnit, std::floor(table.NodesPerUnit));
    ASSERT_LE(table.Nodes, 65536);
    ASSERT_NEAR((table.High - table.Low) * table.NodesPerUnit, table.Nodes - 1, 1e-9);
  }
}

TEST(TransferTable, DifferencesDoNotCancelBesideMuchLargerParts)
{
  // One node is 10^8 times the rest.
  const auto extinction = [](double v) { return std::abs(v - 2000) < 0.5 ? 1e8 : 1 + v / 4096; };
  const TransferTable table =
    BuildTransferTable(FromExtinction(extinction, { 0, 4096 }, 1e-7), { 0, 4096 }, true, 1e-7);
  ASSERT_EQ(table.Nodes, 4097);
  const View view(table);
  for (int i = 0; i < 4096; ++i)
  {
    if (std::abs(i - 2000) > 1 && std::abs(i + 1 - 2000) > 1)
    {
      const double exact = 1 + (i + 0.5) / 4096;
      ASSERT_NEAR(static_cast<double>(view.Between(i, i + 1)), exact, 1e-6 * exact) << i;
    }
  }
  EXPECT_NEAR(static_cast<double>(view.Between(1999, 2001)), 1e8, 10);
}

TEST(TransferTable, PairsOfFloatsHoldFortySixBits)
{
  // Whatever the function: a difference errs by no more than 2^-46 of all that lies before it.
  std::mt19937_64 random(31);
  std::vector<double> knots;
  std::vector<double> values;
  for (int i = 0; i <= 64; ++i)
  {
    knots.push_back(i);
    values.push_back(std::ldexp(1.0, -static_cast<int>(random() % 40)));
  }
  const auto extinction = [&](double v) { return Piecewise(knots, values, v); };
  const TransferTable table =
    BuildTransferTable(FromExtinction(extinction, knots), { 0, 64 }, true, 1e-3);
  const View view(table);
  long double before = 0;
  for (int i = 0; i + 1 < view.Nodes(); ++i)
  {
    const long double step =
      (static_cast<long double>(view.S(i)) + static_cast<long double>(view.NextS(i))) / 2;
    before += step;
    const long double error = std::abs(static_cast<long double>(view.Between(i, i + 1)) - step);
    ASSERT_LE(error, std::ldexp(before, -46) + std::ldexp(step, -22));
  }
}

// Contract 1e: empty means that the table returns exactly 0.
TEST(TransferTable, ZeroIsExactlyZeroAndCounted)
{
  const auto extinction = [](double v)
  {
    const bool visible = (v > 20 && v < 30) || (v > 70 && v < 71) || v > 200;
    return visible ? 5000.0 : 0.0;
  };
  const std::vector<double> knots{ 0, 20, 20, 30, 30, 70, 70, 71, 71, 200, 200, 255 };
  for (const bool integers : { false, true })
  {
    const TransferTable table =
      BuildTransferTable(FromExtinction(extinction, knots, 1e-3), { 0, 255 }, integers, 1e-3);
    const View view(table);
    int empty = 0;
    for (int i = 0; i + 1 < view.Nodes(); ++i)
    {
      const bool zero = view.S(i) == 0 && view.S(i + 1) == 0;
      ASSERT_EQ(view.Occupied(i + 1) == i + 1, !zero);
      if (zero)
      {
        ++empty;
        ASSERT_EQ(view.Between(i, i + 1), 0.0f);
      }
    }
    EXPECT_GT(empty, view.Nodes() / 2);
    EXPECT_LT(empty, view.Nodes());
    // Before the first node nothing is visible, behind the last one the function goes on.
    ASSERT_EQ(table.Occupied.size(), static_cast<std::size_t>(view.Nodes()) + 2);
    EXPECT_GT(view.Occupied(0), 0);
    EXPECT_EQ(view.Occupied(view.Nodes()), view.Nodes());
    // Over any span: no occupied interval if and only if the integral is 0, exactly.
    std::mt19937_64 random(3);
    for (int k = 0; k < 5000; ++k)
    {
      const int a = static_cast<int>(random() % (view.Nodes() - 1));
      const int b = std::min(view.Nodes() - 1, a + 1 + static_cast<int>(random() % 600));
      ASSERT_EQ(view.Occupied(a + 1) > b, view.Between(a, b) == 0.0f);
    }
  }
}

// An invisible function is so everywhere, also where it has no nodes.
// Bounds of the extinction over any range of nodes, by two blocks of a sparse table.
TEST(TransferTable, ExtremesBoundEveryRange)
{
  const TransferTable table = BuildTransferTable(
    FromExtinction([](double x) { return x < 0.3 ? 0 : 1 + std::sin(40 * x); }, { 0, 0.3, 0.7, 1 }),
    { 0, 1 }, false, 1e-3);
  const auto blocks = static_cast<std::size_t>(table.Blocks);
  ASSERT_EQ(table.Extremes.size() % blocks, 0u);
  std::mt19937 random(7);
  std::uniform_int_distribution<std::size_t> any(0, blocks - 1);
  for (int i = 0; i < 2000; ++i)
  {
    const std::size_t a = any(random);
    const std::size_t b = any(random);
    const std::size_t first = std::min(a, b);
    const std::size_t count = std::max(a, b) - first + 1;
    std::size_t level = 0;
    while (std::size_t{ 2 } << level <= count)
    {
      ++level;
    }
    ASSERT_LT(level * blocks, table.Extremes.size());
    const auto& front = table.Extremes[level * blocks + first];
    const auto& back = table.Extremes[level * blocks + first + count - (std::size_t{ 1 } << level)];
    float least = table.Integrals[first * TransferTable::ExtremesBlock][2];
    float largest = least;
    const std::size_t last = std::min(
      (first + count) * TransferTable::ExtremesBlock, static_cast<std::size_t>(table.Nodes) - 1);
    for (std::size_t n = first * TransferTable::ExtremesBlock; n <= last; ++n)
    {
      least = std::min(least, table.Integrals[n][2]);
      largest = std::max(largest, table.Integrals[n][2]);
    }
    ASSERT_EQ(std::min(front[0], back[0]), least);
    ASSERT_EQ(std::max(front[1], back[1]), largest);
  }
}

// Of random steps each is found where it is, at whole numbers or between them, of either side's
// value; between them there is none, however steep the function.
TEST(TransferTable, StepsAreJumps)
{
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 60; ++i)
  {
    const bool below = i % 2 == 0; // which side has the value of the step itself
    const double at = i % 3 == 0 ? 20.0 + i : 20.0 + i + uniform(random);
    const double low = 0.3 * uniform(random);
    const double high = 0.4 + 0.5 * uniform(random);
    const auto opacity = [=](double v)
    {
      const double steep = v < 10 ? 0 : v < 10.05 ? (v - 10) / 0.05 * low : low;
      return v < at || (below && v == at) ? steep : high;
    };
    TransferFunction function;
    function.Opacity = opacity;
    function.Color = White;
    function.Knots = { 10, 10.05, at };
    const TransferTable table = BuildTransferTable(function, { 0, 255 }, i % 4 < 2, 1e-3);
    const View view(table);
    double integral = 0;
    int jumps = 0;
    for (int n = 0; n + 1 < view.Nodes(); ++n)
    {
      const float jump = view.Jump(n);
      integral = view.Between(0, n + 1);
      if (jump == TransferTable::NoJump)
      {
        continue;
      }
      ++jumps;
      ASSERT_NEAR(table.Low + (n + static_cast<double>(jump)) / table.NodesPerUnit, at, 1e-5);
      ASSERT_NEAR(view.S(n), -std::log1p(-low), 1e-6);
      ASSERT_NEAR(view.NextS(n), -std::log1p(-high), 1e-6);
      const double share = view.Between(n, n + 1);
      const double f = static_cast<double>(jump);
      ASSERT_NEAR(share, -f * std::log1p(-low) - (1 - f) * std::log1p(-high), 1e-6);
    }
    ASSERT_EQ(jumps, at < table.High ? 1 : 0) << at;
    ASSERT_GT(integral, 0);
  }
}

TEST(TransferTable, VariationAddsUpTheLargestChange)
{
  auto function = FromExtinction([](double) { return 0.1; }, { 0, 8 });
  function.Color = [](double v, double* rgb)
  {
    rgb[0] = std::abs(v - 4) / 4; // 1 to 0 to 1
    rgb[1] = v / 16;
    rgb[2] = 0.25;
  };
  const TransferTable table = BuildTransferTable(function, { 0, 8 }, false, 1e-3);
  for (int i = 0; i < table.Nodes; ++i)
  {
    ASSERT_NEAR(table.Variation[static_cast<std::size_t>(i)], 2.0 * i / (table.Nodes - 1), 1e-3);
  }
}

TEST(TransferTable, NothingVisible)
{
  const TransferTable table =
    BuildTransferTable(FromExtinction([](double) { return 0; }, { 0, 1 }), { 0, 1 }, false, 1e-3);
  for (const int next : table.Occupied)
  {
    ASSERT_GT(next, table.Nodes);
  }
}

TEST(TransferTable, ColorsOfANodeAndTheNext)
{
  auto function = FromExtinction([](double v) { return 0.2 + 0.1 * v; }, { 0, 8 });
  function.Color = [](double v, double* rgb)
  {
    rgb[0] = 0.5;
    rgb[1] = v / 8;
    rgb[2] = 2 - v; // beyond 0..1: clamped
  };
  const TransferTable table = BuildTransferTable(function, { 0, 8 }, false, 1e-3);
  const View view(table);
  for (int i = 0; i < view.Nodes(); ++i)
  {
    std::array<double, 3> exact{};
    function.Color(view.ValueAt(i), exact.data());
    for (const int c : { 0, 1, 2 })
    {
      ASSERT_NEAR(
        view.ColorOf(i, c), std::clamp(exact[static_cast<std::size_t>(c)], 0.0, 1.0), 1e-5);
      ASSERT_EQ(view.NextColorOf(i, c), view.ColorOf(std::min(i + 1, view.Nodes() - 1), c));
    }
  }
}

TEST(TransferTable, SizesAreThoseOfItsArrays)
{
  const TransferTable table =
    BuildTransferTable(FromExtinction([](double) { return 1; }, { 0, 1 }), { 0, 1 }, false, 1e-3);
  const auto nodes = static_cast<std::size_t>(table.Nodes);
  EXPECT_EQ(table.Integrals.size(), nodes);
  EXPECT_EQ(table.Colors.size(), nodes);
  EXPECT_EQ(table.Variation.size(), nodes);
  EXPECT_EQ(table.SizeInBytes(), nodes * 36 + (nodes + 2) * 2 + table.Extremes.size() * 8);
}

// An opacity that only touches 1: the extinction has no bound there but an integral, as a wall it
// would be a thousand times as much. A place that is 1 stays a wall.
TEST(TransferTable, WallOfOneValue)
{
  for (const double unit : { 0.1, 1.0, 10.0 })
  {
    TransferFunction tent;
    tent.Opacity = [](double v) { return std::clamp(1 - std::abs(v - 100) / 100, 0.0, 1.0); };
    tent.Color = White;
    tent.Knots = { 0, 100, 200 };
    tent.UnitDistance = unit;
    // Also one whose wall isn't a float.
    for (const double step : { 1e-3, 0.1, 0.3 })
    {
      const TransferTable table = BuildTransferTable(tent, { 0, 200 }, false, step);
      const View view(table);
      const int middle = (table.Nodes - 1) / 2;
      EXPECT_EQ(view.S(middle), static_cast<float>(table.WallExtinction));
      EXPECT_NE(view.Jump(middle - 1), TransferTable::NoJump);
      EXPECT_NE(view.Jump(middle), TransferTable::NoJump);
      // With a the opacity, the integral of -ln(1 - a) is (1 - a) ln(1 - a) + a.
      EXPECT_NEAR(view.Integral(0, middle), 100 / unit, 0.005 / unit);
      EXPECT_NEAR(view.Integral(middle, table.Nodes - 1), 100 / unit, 0.005 / unit);
      const double a = (200 - view.ValueAt(middle + 100)) / 100;
      EXPECT_NEAR(view.Integral(middle, middle + 100),
        100 / unit * (1 - ((1 - a) * std::log(1 - a) + a)), 0.005 / unit);
    }
  }
  // At the end of the data, too: the usual ramp.
  TransferFunction ramp;
  ramp.Opacity = [](double v) { return std::clamp(v / 100, 0.0, 1.0); };
  ramp.Color = White;
  ramp.Knots = { 0, 100 };
  const TransferTable table = BuildTransferTable(ramp, { 0, 100 }, false, 1e-3);
  EXPECT_NEAR(View(table).Integral(0, table.Nodes - 1), 100, 0.005);
  // Data beyond it see a wall as wide as they like.
  const TransferTable wide = BuildTransferTable(ramp, { 0, 200 }, false, 1e-3);
  EXPECT_EQ(View(wide).Jump(wide.Nodes - 2), TransferTable::NoJump);
}

} // namespace teravox
