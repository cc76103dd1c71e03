// The section: a plane across an axis, behind which the mesh is hidden.

import { Vector4 } from 'three';
import { shared } from './material.js';

export class Section {

	axis = '';
	/** Local coordinate of the plane. */
	at = 0;
	/** The side that is shown: 1 above the plane, -1 below. */
	side = - 1;

	/** True for a point that is shown. */
	shows( point ) { return ! this.axis || this.side * ( point[ this.axis ] - this.at ) >= 0; }

	/** Sets the plane in the frame of the camera. The whole is computed in double precision. */
	apply( camera ) {

		if ( ! this.axis ) {

			shared.uCut.value.set( 0, 0, 0, 0 );
			return;

		}

		const k = 'xyz'.indexOf( this.axis ), m = camera.matrixWorld.elements;
		// Row k of the camera's matrix: how the axis lies in its frame.
		const row = [ m[ k ], m[ 4 + k ], m[ 8 + k ] ].map( x => x * this.side );
		shared.uCut.value.copy( new Vector4( ...row, this.side * ( camera.position[ this.axis ] - this.at ) ) );

	}

}
