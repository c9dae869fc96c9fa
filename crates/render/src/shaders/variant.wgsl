// What a pipeline is made for: the compiler leaves out the rest, which software drivers would otherwise compute for every pixel.
override SURFACE: u32 = 0u;     // number of the pattern; 100 and more takes no light
override SHADOWS: u32 = 2u;     // 0 none, 1 hard, 2 soft
override TEXTURED: bool = false;
override COAT: bool = true;      // whether there is lacquer
override SOFTBOX: bool = true;   // whether a panel hangs overhead
override OCCLUSION: bool = true; // whether the map of occlusion was drawn
override REFLECTIONS: bool = true; // whether surfaces mirror the sky; else light is a cheap likeness
override ONE_SUN: bool = false; // whether there is one light, and it has a direction alone
