"""The path loop: one kernel for all scenes of a kind, fed with tables of geometry, materials, lights and spectra.

Nothing of a scene is written into the compiled code but which features it has (glass, textures, fog, ...): its surfaces,
spectra and lamps are data. So a new scene compiles nothing, and there are no virtual calls whose cost grows with the number
of objects. Mitsuba traces the rays; everything between two rays is here.

Conventions shared by the modules
---------------------------------
- Coordinates are metres in world axes with the camera at the origin; device numbers are single precision.
- A path carries W wavelengths; a spectral value is an ``ArrayXf`` of W components. Spectra are rows of one table of cell means
  (`wavelengths`); a path's wavelengths are given by their cells (a list of W UInt32) and, where a formula needs them, in nm.
- Local shading frame: +z is the shading normal on the surface's own front side. `wi` points back along the path (towards the
  camera), `wo` onwards (towards the light); both point away from the surface.
- A density is over solid angle [sr^-1]; 0 stands for a delta distribution or for nothing at all.
- Radiance is in W m^-2 sr^-1 nm^-1 on its way; photons are made where it meets a channel's response.
"""
