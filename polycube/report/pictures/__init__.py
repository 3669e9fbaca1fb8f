"""Pictures: scenes, their off-screen renderer, the denoising."""
