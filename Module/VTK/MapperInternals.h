// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ColorAndDepthImage.h"
#include "DepthPeeling.h"
#include "DrawnInput.h"
#include "InputArray.h"
#include "MaskInput.h"
#include "PropertyFunctions.h"
#include "SecondArray.h"
#include "SliceDepths.h"
#include "VolumeEngine.h"
#include "VolumeMixer.h"
#include "VolumePick.h"
#include "vtkBrickSource.h"
#include "vtkCallbackCommand.h"
#include "vtkNew.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkRenderer.h"
#include "vtkRendererCollection.h"
#include "vtkSmartPointer.h"
#include "vtkTrivialProducer.h"
#include "vtkWeakPointer.h"

#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

class vtkHardwareSelector;
class vtkMultiVolume;
class vtkVolume;
class vtkVolumeProperty;

namespace teravox
{

/// One of the volumes that a mapper draws: how it comes from its input, and what draws it.
struct MapperVolume
{
  VolumeEngine Engine;
  SliceDepths Slice;
  InputArray Arrays; ///< the source made from an ordinary array
  MaskInput Mask;
  SecondArray Second;

  /// One scalar of the components of a source, and which.
  std::shared_ptr<BrickSource> Scalars;
  std::shared_ptr<BrickSource> ScalarsSource;
  int ScalarsComponent = 0;
  int FunctionComponent = 0; ///< whose functions and material are those of scalars

  vtkMTimeType FunctionTime = 0;
  vtkVolumeProperty* FunctionOf = nullptr;
  std::shared_ptr<BrickSource> FunctionFor;
  RangeChoice FunctionRange;
  float FunctionBlend = 1;   ///< MaskBlendFactor
  double FunctionLength = 0; ///< ShortestLength that it was sampled for
  std::uint64_t FunctionVersion = 0;
  std::shared_ptr<BrickSource> Timed;
};

/// What a mapper is about to draw of one of its volumes.
struct MapperFrame
{
  FrameRequest Request;
  teravox::Drawn Drawn;
  int Components = 1;
  bool ByImage = false; ///< IsImageDrawn()
};

// Floats per pixel become an image; false if there are none.
bool SetPixels(vtkImageData* image, const std::vector<float>& pixels, int width, int height);

} // namespace teravox

// The class itself, in vtkOutOfCoreVolumeMapper.cxx, draws; Mapper*.cxx have the rest of it.
class vtkOutOfCoreVolumeMapper::vtkInternals : public teravox::MapperVolume
{
public:
  teravox::DepthPeeling Peeling;
  // A frame that is drawn in stretches is complete when its renderer says so.
  vtkNew<vtkCallbackCommand> FrameEnds;
  vtkWeakPointer<vtkRenderer> FrameOf;
  unsigned long FrameTag = 0;
  void FinishFrame(vtkOutOfCoreVolumeMapper* mapper);
  vtkSmartPointer<vtkBrickSource> Explicit;
  vtkSmartPointer<vtkTrivialProducer> StandIn; // input for volumes that come from SetBrickSource()
  bool UsesStandIn = false;

  // Of a vtkMultiVolume: the volumes of ports other than 0, whose is this one; none else.
  std::map<int, std::unique_ptr<teravox::MapperVolume>> Others;
  teravox::VolumeMixer Mixer;
  // Sums and the like over all volumes.
  template <typename F>
  void ForEachVolume(const F& f)
  {
    f(static_cast<teravox::MapperVolume&>(*this));
    for (const auto& other : this->Others)
    {
      f(*other.second);
    }
  }
  template <typename R>
  R Total(R (teravox::VolumeEngine::*of)() const)
  {
    R sum{};
    this->ForEachVolume([&](teravox::MapperVolume& v) { sum += (v.Engine.*of)(); });
    return sum;
  }
  template <typename R>
  R FrameTotal(R teravox::FrameStatistics::*of)
  {
    R sum{};
    this->ForEachVolume([&](teravox::MapperVolume& v) { sum += v.Engine.LastFrame().*of; });
    return sum;
  }
  bool IsConverged()
  {
    bool all = this->Others.empty() || this->Mixer.IsComplete();
    this->ForEachVolume(
      [&](teravox::MapperVolume& v) { all = all && v.Engine.LastFrame().Converged; });
    return all;
  }

  // Whose context holds what the engines have on the GPU, and when that context was made: a window
  // may get another one.
  vtkWeakPointer<vtkOpenGLRenderWindow> Window;
  vtkMTimeType ContextTime = 0;
  vtkNew<vtkCallbackCommand> WindowGoes; // the last chance to free what lives in its context
  unsigned long WindowTag = 0;
  void Adopt(vtkOutOfCoreVolumeMapper* mapper, vtkOpenGLRenderWindow* window, vtkRenderer* drawing);

  std::set<std::string> Warned;
  std::string LastError;
  std::set<std::string> ReportedFailures;
  bool WasConverged = false;
  double SourceTime = 0;
  double FirstPicture = 0;
  double ConvergedAfter = 0;
  const void* LastView = nullptr;
  const void* LastRenderer = nullptr;
  // An error that comes with every frame is said once.
  void Fail(vtkOutOfCoreVolumeMapper* mapper, const std::string& message);
  // What couldn't be read of a volume since the last call.
  void ReportFailures(
    vtkOutOfCoreVolumeMapper* mapper, teravox::VolumeEngine& engine, const std::string& name);
  void WarnOnce(
    vtkOutOfCoreVolumeMapper* mapper, const std::string& key, const std::string& message);

  void TellNeeds(
    vtkOutOfCoreVolumeMapper* mapper, const std::vector<teravox::VolumeMixer::Part>& parts);
  static void BeginProp(vtkHardwareSelector* selector, teravox::FrameRequest& request);
  bool IsDrawn(vtkOutOfCoreVolumeMapper* mapper, vtkRenderer* ren, const teravox::Status& status,
    bool timedOut);
  void EndDrawing(vtkOutOfCoreVolumeMapper* mapper, vtkRenderer* ren, bool isPeeling, double began);
  void KeepVolumes(const std::set<int>& ports);
  // Everything about a volume that isn't drawing it. `volume`: place and property; `prop`: what the
  // renderer has. Nothing, after an error, if there is nothing to draw.
  std::optional<teravox::MapperFrame> Prepare(vtkOutOfCoreVolumeMapper* mapper,
    teravox::MapperVolume& part, int port, vtkRenderer* ren, vtkVolume* volume, vtkVolume* prop);
  // MapperPrepare.cxx: its parts.
  teravox::Drawn FindInput(vtkOutOfCoreVolumeMapper* mapper, teravox::MapperVolume& part, int port);
  // What is drawn of a source: itself, or one scalar of it.
  static std::shared_ptr<teravox::BrickSource> ScalarsOf(vtkOutOfCoreVolumeMapper* mapper,
    teravox::MapperVolume& part, vtkVolumeProperty* property,
    const std::shared_ptr<teravox::BrickSource>& source);
  // That, with what decides beside it what is seen: another array, a mask.
  std::shared_ptr<teravox::BrickSource> ChooseSource(vtkOutOfCoreVolumeMapper* mapper,
    teravox::MapperVolume& part, teravox::MapperFrame& frame, vtkVolume* volume, bool together);
  static void SetCamera(vtkOutOfCoreVolumeMapper* mapper, vtkRenderer* ren, vtkVolume* volume,
    const teravox::Drawn& drawn, teravox::FrameRequest& request);
  static void SetOptions(vtkOutOfCoreVolumeMapper* mapper, teravox::FrameRequest& request);
  bool SetBlend(vtkOutOfCoreVolumeMapper* mapper, teravox::MapperVolume& part, vtkVolume* volume,
    int components, bool together, teravox::FrameRequest& request);
  static void SetPatience(vtkOutOfCoreVolumeMapper* mapper, vtkOpenGLRenderWindow* window,
    vtkVolume* prop, teravox::FrameRequest& request);
  static teravox::EngineSettings SettingsOf(vtkOutOfCoreVolumeMapper* mapper);
  static void SetFunctions(vtkOutOfCoreVolumeMapper* mapper, teravox::MapperVolume& part,
    vtkVolumeProperty* property, const std::shared_ptr<teravox::BrickSource>& source,
    const teravox::RangeChoice& range, bool masked, double shortestLength);
  // MapperMultiVolume.cxx
  void RenderTogether(
    vtkOutOfCoreVolumeMapper* mapper, vtkRenderer* ren, vtkMultiVolume* volumes, double began);
  std::uint64_t MixBytes = 0; // that MixedRays take, of the budget of the GPU

  // What was drawn last in each renderer.
  struct Shown
  {
    teravox::FrameRequest Request;
    std::uint64_t FunctionVersion = 0;
    std::shared_ptr<teravox::BrickSource> Source;
    int Components = 1;
    bool Dependent = false;
  };
  std::map<const void*, Shown> Shown_;

  // Likewise of several volumes; the others' are in Others.
  struct ShownTogether
  {
    const teravox::MapperVolume* Volume = nullptr;
    std::uint64_t FunctionVersion = 0;
    teravox::PickPart Part;
  };
  std::map<const void*, std::vector<ShownTogether>> Together;
  // What was drawn last in a renderer; and only if that is still the same volumes with the same
  // functions.
  std::vector<teravox::PickPart> DrawnIn(const void* renderer);
  std::vector<teravox::PickPart> Pickable(vtkRenderer* renderer);

  // What blocks in front of the drawn one hide; confirmed for what was drawn last then.
  using Tiles = std::shared_ptr<const std::vector<float>>;
  Tiles Suspected;
  Tiles Confirmed;
  Shown ConfirmedFor;
  void ChooseHidden(
    teravox::FrameRequest& request, const std::shared_ptr<teravox::BrickSource>& source);

  // Each eye has a view of its own: both pictures stay.
  static const void* ViewOf(vtkRenderer* ren, bool rightEye)
  {
    return static_cast<const char*>(static_cast<const void*>(ren)) + (rightEye ? 1 : 0);
  }
  // So have stretches of several volumes.
  static const void* ScratchOf(const void* view) { return static_cast<const char*>(view) + 2; }

  // Forgets what belongs to renderers that the window doesn't have any more.
  void KeepRenderers(vtkRenderWindow* window, vtkRenderer* drawing);

  // VolumeEngine::ReadColors() of the last frame, of all volumes together.
  std::vector<float> ReadColors(int& width, int& height)
  {
    this->Window->MakeCurrent();
    return this->Others.empty() ? this->Engine.ReadColors(this->LastView, width, height)
                                : this->Mixer.ReadColors(this->LastView, width, height);
  }

  // First hits of each volume that was drawn; nothing if that looked for none.
  std::vector<teravox::SeenVolume> ReadHits(const std::vector<teravox::PickPart>& parts);
};
