# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What the panels and menus show: documentation of each property, icons."""
import os
import unittest
import xml.etree.ElementTree as ElementTree

from support import main, pv

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "Teravox")
PROXIES = [("sources", "HDF5VolumeReader", "pyramid"), ("sources", "ProceduralVolume", "formula"),
           ("filters", "RepeatVolume", "repeat"), ("representations", "OutOfCoreVolumeRepresentation", None)]


def xml(name):
    return ElementTree.parse(os.path.join(FOLDER, name)).getroot()


def declared():
    """Elements of our files: group, name of the proxy, the proxy."""
    for name in ("readers.xml", "representation.xml"):
        for group in xml(name).iter("ProxyGroup"):
            for proxy in group:
                if proxy.tag in ("SourceProxy", "RepresentationProxy"):
                    yield group.get("name"), proxy.get("name"), proxy


class Panels(unittest.TestCase):
    def test_each_property_is_documented(self):
        manager = pv.servermanager.ProxyManager()
        found = []
        for group, name, element in declared():
            found.append((group, name))
            prototype = manager.GetPrototypeProxy(group, name)
            self.assertGreater(len(prototype.GetDocumentation().GetDescription().strip()), 30, name)
            properties = [e.get("name") for e in element if e.tag.endswith("Property")]
            self.assertGreater(len(properties), 2, name)
            for property in properties:
                documentation = prototype.GetProperty(property).GetDocumentation()
                text = documentation.GetDescription().strip() if documentation else ""
                self.assertGreater(len(text), 10, "%s.%s isn't documented" % (name, property))
                self.assertEqual(text[-1], ".", "%s.%s: %s" % (name, property, text))
        self.assertEqual(found, [p[:2] for p in PROXIES])

    def test_each_property_is_in_the_panel(self):
        """Of the representation: its group names all properties that it declares, and no others."""
        root = xml("representation.xml")
        group, = [g for g in root.iter("PropertyGroup") if g.get("label") == "Out of Core"]
        shown = [p.get("name") for p in group.iter("Property")]
        proxy, = root.iter("RepresentationProxy")
        self.assertEqual(sorted(shown), sorted(e.get("name") for e in proxy if e.tag.endswith("Property")))

    def test_groups_are_whole(self):
        """A group that takes the place of one of ParaView's has all properties of it."""
        proxy = pv.servermanager.ProxyManager().GetPrototypeProxy("representations", "UniformGridRepresentation")
        groups = {}
        for i in range(proxy.GetNumberOfPropertyGroups()):
            group = proxy.GetPropertyGroup(i)
            names = [proxy.GetPropertyName(group.GetProperty(k)) for k in range(group.GetNumberOfProperties())]
            groups.setdefault(group.GetXMLLabel(), []).append(sorted(names))
        ours = [g.get("label") for g in xml("representation.xml").find(".//Extension").findall("PropertyGroup")]
        self.assertEqual(ours, ["Styling", "Lighting", "Volume Rendering", "Cropping Parameters"])
        for label in ours:
            self.assertEqual(len(groups[label]), 2, label)
            self.assertEqual(*groups[label], label)

    def test_icons(self):
        resources = {":%s/%s" % (q.get("prefix"), f.text): os.path.join(FOLDER, f.text)
                     for q in xml("Teravox.qrc").iter("qresource") for f in q}
        for path in resources.values():
            self.assertTrue(ElementTree.parse(path).getroot().tag.endswith("svg"), path)
        controller = pv.servermanager.ParaViewPipelineController()
        used = set()
        for group, name, icon in PROXIES:
            if icon:
                proxy = pv.servermanager.ProxyManager().NewProxy(group, name)
                used.add(controller.GetPipelineIcon(proxy, 0))
                self.assertIn(controller.GetPipelineIcon(proxy, 0), resources)
                self.assertTrue(controller.GetPipelineIcon(proxy, 0).endswith(icon + ".svg"))
        for menu in xml("readers.xml").iter("ShowInMenu"):
            self.assertIn(menu.get("icon"), resources)
        self.assertEqual(used, set(resources))
        # They are in the plugin, where that has an interface: Qt finds them by their names there.
        with open(os.environ["TERAVOX_PLUGIN"], "rb") as f:
            plugin = f.read()
        if b"libQt5Core" in plugin:
            for path in resources:
                self.assertIn(os.path.basename(path).encode("utf-16-be"), plugin, path)


if __name__ == "__main__":
    main()
