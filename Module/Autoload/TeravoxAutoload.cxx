// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What VTK loads from the folders of VTK_AUTOLOAD_PATH: an object factory that makes a
// vtkOutOfCoreVolumeMapper where a program asks for a vtkGPUVolumeRayCastMapper. Programs that are
// linked already get it through VTK's own classes (vtkSmartVolumeMapper,
// vtkMultiBlockVolumeMapper), too.
//
// Not endless: vtkOutOfCoreVolumeMapper::New() constructs, it asks no factory.
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <string>
#include <vtkObjectFactory.h>
#include <vtkVersion.h>

namespace
{

// TERAVOX_REPLACE; unset means on, because who sets VTK_AUTOLOAD_PATH asks for it.
bool IsOn()
{
  const char* set = std::getenv("TERAVOX_REPLACE");
  std::string value = set != nullptr ? set : "";
  std::transform(value.begin(), value.end(), value.begin(),
    [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::array<const char*, 4> off{ "0", "off", "no", "false" };
  return std::find(off.begin(), off.end(), value) == off.end();
}

vtkObject* MakeMapper()
{
  vtkOutOfCoreVolumeMapper* mapper = vtkOutOfCoreVolumeMapper::New();
  mapper->WarnOfSamplingOff();
  return mapper;
}

class vtkTeravoxAutoloadFactory : public vtkObjectFactory
{
public:
  static vtkTeravoxAutoloadFactory* New();
  vtkTypeMacro(vtkTeravoxAutoloadFactory, vtkObjectFactory);

  // What this file was compiled with: VTK refuses factories of another version.
  const char* GetVTKSourceVersion() override { return VTK_SOURCE_VERSION; }
  const char* GetDescription() override
  {
    return "Teravox: vtkOutOfCoreVolumeMapper in the place of vtkGPUVolumeRayCastMapper";
  }

  vtkTeravoxAutoloadFactory(const vtkTeravoxAutoloadFactory&) = delete;
  void operator=(const vtkTeravoxAutoloadFactory&) = delete;

protected:
  vtkTeravoxAutoloadFactory()
  {
    const bool on = IsOn();
    if (on)
    {
      // The first factory wins. Loading this library has loaded VTK's rendering libraries, whose
      // own factories may have been registered meanwhile, ahead of this one.
      vtkObjectFactory::SetAllEnableFlags(
        0, "vtkGPUVolumeRayCastMapper", "vtkOpenGLGPUVolumeRayCastMapper");
    }
    this->RegisterOverride("vtkGPUVolumeRayCastMapper", "vtkOutOfCoreVolumeMapper",
      "Volumes of any size (TERAVOX_REPLACE=0 turns this off)", on ? 1 : 0, MakeMapper);
  }
  ~vtkTeravoxAutoloadFactory() override = default;
};

vtkStandardNewMacro(vtkTeravoxAutoloadFactory);

} // namespace

VTK_FACTORY_INTERFACE_IMPLEMENT(vtkTeravoxAutoloadFactory)
