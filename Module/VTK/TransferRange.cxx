// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TransferRange.h"

#include <cmath>
#include <vector>
#include <vtkColorTransferFunction.h>
#include <vtkPiecewiseFunction.h>

namespace teravox
{

namespace
{

bool IsFinite(const ValueRange& range)
{
  return range.IsKnown() && !range.IsVoid() && std::isfinite(range.Min) &&
    std::isfinite(range.Max) && std::isfinite(range.Max - range.Min);
}

// Midpoints and sharpnesses are relative to the nodes beside them and stay.
template <int Numbers, typename Function>
void Stretch(Function* function, const ValueRange& data)
{
  double own[2];
  function->GetRange(own);
  if (function->GetSize() < 2 || !(own[1] > own[0]) || !(data.Max > data.Min))
  {
    return;
  }
  std::vector<double> nodes(
    static_cast<std::size_t>(Numbers) * static_cast<std::size_t>(function->GetSize()));
  for (int i = 0; i < function->GetSize(); ++i)
  {
    double* node = &nodes[static_cast<std::size_t>(Numbers) * static_cast<std::size_t>(i)];
    function->GetNodeValue(i, node);
    node[0] = data.Min + (node[0] - own[0]) / (own[1] - own[0]) * (data.Max - data.Min);
  }
  function->RemoveAllPoints();
  for (std::size_t i = 0; i < nodes.size(); i += Numbers)
  {
    const double* n = &nodes[i];
    if constexpr (Numbers == 4)
    {
      function->AddPoint(n[0], n[1], n[2], n[3]);
    }
    else
    {
      function->AddRGBPoint(n[0], n[1], n[2], n[3], n[4], n[5]);
    }
  }
}

} // namespace

void FitToRange(vtkPiecewiseFunction* function, const ValueRange& data, bool native)
{
  if (!IsFinite(data))
  {
    return;
  }
  if (function->GetSize() < 1)
  {
    function->AddPoint(data.Min, 0);
    function->AddPoint(data.Max, 0.5);
  }
  if (native)
  {
    Stretch<4>(function, data);
  }
}

void FitToRange(vtkColorTransferFunction* function, const ValueRange& data, bool native)
{
  if (!IsFinite(data))
  {
    return;
  }
  if (function->GetSize() < 1)
  {
    function->AddRGBPoint(data.Min, 0, 0, 0);
    function->AddRGBPoint(data.Max, 1, 1, 1);
  }
  if (native)
  {
    Stretch<6>(function, data);
  }
}

} // namespace teravox
