// Keeps pictures coming while the view moves: on a slow machine with fewer triangles, then with fewer pixels. At rest
// everything is drawn, but not all the time while tiles are loading.

/** Time of a picture of a moving view that is slow, and that is fast enough for more detail, in ms. */
export const SLOW = 60;
const FAST = 30;

/** The view rests if it did not move for this long, in ms. */
const REST = 300;

/** The largest factor on the error of tiles. */
const COARSEST = 256;

/** The factor from which on pictures have half the pixels each way. */
const HALF = 8;

/** While tiles are loading, a view at rest is drawn after this many times the time of a picture. */
const SPARE = 3;

export class Pace {

	constructor() {

		this.factor = 1;
		this.until = - Infinity;
		this.last = - Infinity;
		this.cost = 0;
		this.mean = 0;

	}

	/** True while the view moves. */
	moves( now ) { return now < this.until; }

	/** The camera has moved. */
	moved( now ) {

		if ( ! this.moves( now ) ) this.mean = 0;
		this.until = now + REST;

	}

	/** True if a picture should be drawn now; `loading` tells whether more tiles are on their way. */
	due( now, loading ) { return ! loading || this.moves( now ) || now - this.last >= SPARE * this.cost; }

	/** A picture was begun at a time, and took so many ms; `moving` tells whether the view moved. */
	took( begun, milliseconds, moving ) {

		this.last = begun;
		this.cost = milliseconds;
		if ( ! moving ) return;
		// Tiles that are new to the graphics take longer once; very slow pictures need an answer at once.
		const part = milliseconds > 8 * SLOW || this.mean === 0 ? 1 : 0.3;
		this.mean += part * ( milliseconds - this.mean );
		// Triangles are as the inverse square of the error.
		if ( this.mean > SLOW ) this.factor = Math.min( this.factor * Math.min( 1.1 * Math.sqrt( this.mean / SLOW ), 4 ), COARSEST );
		else if ( this.mean < FAST ) this.factor = Math.max( this.factor / 1.1, 1 );

	}

	/** Factor on the error of tiles. */
	coarser( now ) { return this.moves( now ) ? this.factor : 1; }

	/** Pixels each way, as a part of all. */
	pixels( now ) { return this.moves( now ) && this.factor >= HALF ? 0.5 : 1; }

}

/** Tells when the graphics have finished a picture. */
export class Fence {

	constructor( gl ) {

		this.gl = gl;
		this.sync = null;

	}

	/** A picture was given to the graphics. */
	set( now, moving ) {

		if ( this.sync ) return;
		const { gl } = this;
		this.sync = gl.fenceSync( gl.SYNC_GPU_COMMANDS_COMPLETE, 0 );
		gl.flush();
		Object.assign( this, { begun: now, moving } );

	}

	/** Time since the oldest picture that is not finished was begun, in ms. */
	pending( now ) { return this.sync ? now - this.begun : 0; }

	/** Tells `pace` of a picture that is finished. */
	poll( now, pace ) {

		const { gl, sync } = this;
		if ( ! sync || gl.getSyncParameter( sync, gl.SYNC_STATUS ) !== gl.SIGNALED && ! gl.isContextLost() ) return;
		gl.deleteSync( sync );
		this.sync = null;
		pace.took( this.begun, now - this.begun, this.moving );

	}

}
